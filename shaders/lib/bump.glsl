// Normals bent by the gradient of a height. Twin: glbump/reference/bump.py. Derivation: docs/bump.md.

// Surface gradient of a height B with partial derivatives slope = (dB/du, dB/dv):
//   grad B = (Bu (Pv x n) + Bv (n x Pu)) / J,  J = n . (Pu x Pv)
// (Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010; equal to Blinn's 1978 small-B form with
// the sign of NUMERICS 1.1.) The signed J makes mirrored u,v right. Lengths are divided out first, so that no
// scale of the scene under- or overflows. Where u,v have no area there is no gradient: zero.
vec3 surface_gradient(vec3 n, vec3 dpdu, vec3 dpdv, vec2 slope) {
    float len_u = length(dpdu);
    float len_v = length(dpdv);
    vec3 tu = dpdu / max(len_u, 1e-30);
    vec3 tv = dpdv / max(len_v, 1e-30);
    float j = dot(n, cross(tu, tv));
    if (abs(j) < 1e-6 || len_u < 1e-18 || len_v < 1e-18) return vec3(0.0);
    return (slope.x / len_u * cross(tv, n) + slope.y / len_v * cross(n, tu)) / j;
}

// The same of a height that is known pixel by pixel, on a surface with neither u,v nor tangents: the screen's x and y
// are its parameters (Mikkelsen 2010). Differences are one-sided: the error grows as the pixel does, and as the waves of
// the height get shorter. p is best relative to the eye, so that few digits cancel.
vec3 surface_gradient_screen(vec3 n, vec3 p, float height) {
    return surface_gradient(n, dFdx(p), dFdy(p), vec2(dFdx(height), dFdy(height)));
}

// Blinn's full form, for heights that are not small beside the surface's radii of curvature. With P' = P + B n:
//   N' = P'u x P'v = (Pu + B n_u + Bu n) x (Pv + B n_v + Bv n) = a x c + Bu (n x c) + Bv (a x n),
//   a = Pu + B n_u,  c = Pv + B n_v,
// so it is the gradient above, on the surface moved out evenly by B. dndu, dndv: of the unit normal; what they have
// along n does not count. n - gradient stays on n's side, also past a centre of curvature, where the moved surface is
// inside out; next to the centre it lies flat, and where that is met to the bit there is no gradient: zero.
// |height| up to 1e18.
vec3 full_gradient(vec3 n, vec3 dpdu, vec3 dpdv, vec3 dndu, vec3 dndv, float height, vec2 slope) {
    return surface_gradient(n, dpdu + height * dndu, dpdv + height * dndv, slope);
}

// Blinn's bump that does not know lengths (thesis, 1978, p. 140): n turned by the angle whose tangent is |slope|, about
// the direction along which the height stays the same, Bv Pu - Bu Pv. A surface of any size then looks the same, and as
// bumpy where u,v are stretched. As a gradient: surface_gradient's direction, |slope| long.
vec3 invariant_gradient(vec3 n, vec3 dpdu, vec3 dpdv, vec2 slope) {
    float steeper = max(abs(slope.x), abs(slope.y));
    if (steeper == 0.0) return vec3(0.0);
    vec3 gradient = surface_gradient(n, dpdu, dpdv, slope / steeper);
    vec3 a = abs(gradient);
    float longest = max(a.x, max(a.y, a.z));
    if (longest == 0.0) return vec3(0.0);
    return steeper * length(slope / steeper) * normalize(gradient / longest);
}

// surface_gradient where dp/du and dp/dv are at right angles and in the tangent plane, as on a sphere or a torus that is
// not stretched: each partial derivative has its own direction. Zero along one shorter than 1e-12, next to a pole:
// slopes up to 1e12 stay in range for surfaces about 1 wide, as the GPU has them all.
vec3 orthogonal_gradient(vec3 dpdu, vec3 dpdv, vec2 slope) {
    float uu = dot(dpdu, dpdu);
    float vv = dot(dpdv, dpdv);
    return (uu > 1e-24 ? slope.x / uu : 0.0) * dpdu + (vv > 1e-24 ? slope.y / vv : 0.0) * dpdv;
}

// The surface gradient of a height that is known in space, from its gradient there: what that has along the surface.
// (Perlin's n - g keeps the rest, and bends otherwise: Mikkelsen, "Surface Gradient-Based Bump Mapping Framework", 2020.)
vec3 volume_gradient(vec3 n, vec3 g) {
    return g - dot(n, g) * n;
}

// Shares, 1 in all, of three maps laid along the axes: squares of the normal's components, to the fourth power, so that
// two maps are mixed within some 15 degrees of where they meet. No normal, no share.
vec3 triplanar_shares(vec3 n) {
    vec3 square = n * n;
    vec3 fourth = square * square;
    vec3 share = fourth * fourth;
    return share / max(share.x + share.y + share.z, 1e-30);
}

// The bent normal, unit length. A slope past 1e18 would overflow the dot product: the largest component is
// divided out first.
vec3 bump_normal(vec3 n, vec3 gradient) {
    vec3 bent = n - gradient;
    vec3 a = abs(bent);
    return normalize(bent / max(a.x, max(a.y, a.z)));
}

// Tangent and bitangent of a normal map on a surface: t along dp/du in the tangent plane, b = w cross(n, t)
// with w the handedness of u,v, so that mirrored maps keep their +Y. Both zero where u has no direction: no bump.
void tangent_frame(vec3 n, vec3 dpdu, vec3 dpdv, out vec3 t, out vec3 b) {
    vec3 along = dpdu - n * dot(n, dpdu);
    float len = length(along);
    t = len > 1e-18 ? along / len : vec3(0.0);
    b = cross(n, t);
    b = dot(b, dpdv) < 0.0 ? -b : b;
}
