// Footprints to mip levels. Twin: glbump/reference/filter.py.

// Change of a texture coordinate that wraps at 1, across a seam: the short way round.
vec2 wrapped_difference(vec2 difference) {
    return difference - round(difference);
}

// Mip level by the longer side of a footprint given as two vectors in texels (OpenGL 4.6, equation 8.10,
// with rho = max of the two lengths). -63 for no footprint at all.
float isotropic_level(vec2 ddx, vec2 ddy) {
    return 0.5 * log2(max(max(dot(ddx, ddx), dot(ddy, ddy)), exp2(-126.0)));
}

// Mip level of a direction's footprint by its longer side, for texels_per_radian texels a radian: chord length for angle,
// which is right to 1 % below 0.5 rad. The same at a seam, at a pole and anywhere else.
float longest_level(vec3 ddx, vec3 ddy, float texels_per_radian) {
    float longest = max(dot(ddx, ddx), dot(ddy, ddy));
    return 0.5 * log2(max(longest * texels_per_radian * texels_per_radian, exp2(-126.0)));
}

// Mip level of a direction's footprint by its solid angle, over that of a texel: curved mirrors have long thin
// footprints, and the longer side's level blurs across them. The longer side counts as 8 times the shorter at most; along
// one that is thinner still nothing would be averaged.
float direction_level(vec3 ddx, vec3 ddy, float texels_per_radian) {
    // The square of its ellipse's longer axis, whichever two vectors span it.
    float half_difference = 0.5 * (dot(ddx, ddx) - dot(ddy, ddy));
    float longest = 0.5 * (dot(ddx, ddx) + dot(ddy, ddy)) + length(vec2(half_difference, dot(ddx, ddy)));
    float area = max(length(cross(ddx, ddy)), 0.125 * longest);
    return 0.5 * log2(max(area * texels_per_radian * texels_per_radian, exp2(-126.0)));
}

// The share of a footprint that lies above 0, of a height that changes by ddx and ddy across it: a ramp as wide as
// the footprint (exact for one along the change). Without a footprint: 1 above, 0 below, 1/2 at 0.
float share_above(float height, float ddx, float ddy) {
    float width = abs(ddx) + abs(ddy);
    if (width < 1e-30) return height > 0.0 ? 1.0 : height < 0.0 ? 0.0 : 0.5;
    return clamp(0.5 + height / width, 0.0, 1.0);
}

// The axes of the footprint with the sides ddx and ddy, the longer one first: at right angles, as long as the ellipse
// that such a parallelogram stands for, whose moments are the same. Nothing is wider than long.
void footprint_axes(vec3 ddx, vec3 ddy, out vec3 major, out vec3 minor) {
    float x = dot(ddx, ddx);
    float y = dot(ddy, ddy);
    vec2 uneven = vec2(x - y, 2.0 * dot(ddx, ddy)) / max(x + y, 1e-36);
    uneven /= max(length(uneven), 1e-15);
    // The sine and the cosine of half the angle: the larger by a root, in which the smaller would cancel.
    float larger = sqrt(0.5 + 0.5 * abs(uneven.x));
    float smaller = 0.5 * uneven.y / larger;
    vec2 turn = uneven.x < 0.0 ? vec2(abs(smaller), uneven.y < 0.0 ? -larger : larger) : vec2(larger, smaller);
    major = turn.x * ddx + turn.y * ddy;
    minor = turn.x * ddy - turn.y * ddx;
}

// How many samples along a footprint of a direction with these axes: as many as it is longer than wide, and no more than
// texels along it, for texels_per_radian texels a radian; from 1 to `most`. A hundredth more is no reason for another:
// a round one is 1 but for rounding.
float footprint_taps(vec3 major, vec3 minor, float texels_per_radian, float most) {
    float longer = length(major);
    return clamp(ceil(min(longer / max(length(minor), 1e-30), longer * texels_per_radian) - 0.01), 1.0, most);
}
