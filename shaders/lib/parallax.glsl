// Where a near environment is seen: from the point where it was taken to the point of its walls that a ray meets.
// Twin: glbump/reference/parallax.py. All positions are relative to where it was taken; dir may be of any length,
// the answer is of unit length and tends to dir where the walls are far: off by |p| over their distance.

#include "direction.glsl"

// To the ray's way out of a box (Lagarde and Zanuttini, "Local Image-Based Lighting", SIGGRAPH 2012). From outside
// that is the far side; a ray that misses the box is followed to where it leaves the first pair of walls, or not at all
// if that lies behind.
vec3 box_parallax(vec3 p, vec3 dir, vec3 low, vec3 high) {
    const float FAR = 1e30;  // walls beyond it are as far as none
    vec3 d = finite_dir(dir);
    d /= largest_part(d);
    vec3 wall = mix(low, high, greaterThan(d, vec3(0.0))) - p;
    float t = FAR;
    // Walls that the ray is parallel to it never meets, also where it lies in one: 0 / 0.
    if (d.x != 0.0) t = min(t, wall.x / d.x);
    if (d.y != 0.0) t = min(t, wall.y / d.y);
    if (d.z != 0.0) t = min(t, wall.z / d.z);
    return unit_dir(p + max(t, 0.0) * d);
}

// To the ray's way out of a sphere. From outside that is the far side; a ray that misses the sphere is followed to
// where it comes nearest, or not at all if that lies behind. In units of the radius, so that no square overflows.
vec3 sphere_parallax(vec3 p, vec3 dir, vec3 centre, float radius) {
    vec3 d = unit_dir(dir);
    vec3 from = (p - centre) / radius;
    float along = dot(from, d);
    // The square of the half chord: 1 - |from|^2 + along^2 would cancel far outside.
    vec3 nearest = from - along * d;
    float t = sqrt(max(1.0 - dot(nearest, nearest), 0.0)) - along;
    return unit_dir(p / radius + max(t, 0.0) * d);
}
