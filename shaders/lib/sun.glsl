// The light of one sun, a small disc of even light. Twin: glbump/reference/sun.py.

#include "reflect.glsl"

// Radiance that a glossy surface turns towards v, per irradiance of a sun that it faces: GGX's D, Smith's shadows
// correlated in height (Heitz 2014) and Schlick's Fresnel; 0 where the sun is below the surface. radius: of the sun,
// radians. n, v (towards the eye) and sun_dir unit length; n.v below 1e-4 counts as that.
//
// The sun as a disc: its half vectors are an ellipse, half its radius high along the plane of v and sun_dir and that
// over v.h wide across. The mean of D over a disc of radius R about its peak is that of (alpha^2 + x^2)^-2 alpha^2 / pi,
// which is 1 / (pi (alpha^2 + R^2)): the peak of a lobe of alpha^2 + R^2. So along each axis the square of its half
// length is added, as variances are (Tokuyoshi and Kaplanyan 2019). Error against the integral over the disc, of the
// highlight's peak, n.v from 0.2: 0.12 for radii up to alpha, 0.2 up to 2 alpha; wider suns keep too soft an edge, off by
// up to 0.7 there. Never more than of a mirror, which shows the sun itself.
vec3 sun_reflected(vec3 n, vec3 v, vec3 sun_dir, float radius, float roughness, vec3 f0) {
    const float PI = 3.14159265358979323846;
    float n_dot_l = dot(n, sun_dir);
    if (n_dot_l <= 0.0) return vec3(0.0);
    float n_dot_v = max(dot(n, v), 1e-4);
    vec3 h = normalize(v + sun_dir);
    float v_dot_h = dot(v, h);
    float alpha = roughness * roughness;
    float square = alpha * alpha;
    float half_radius = 0.5 * radius;
    float ahead = square + half_radius * half_radius;
    float aside = square + half_radius * half_radius / (v_dot_h * v_dot_h);
    // Where v and sun_dir are one, across is shorter than 1, and both axes are alike.
    vec3 across = cross(v, sun_dir);
    across *= inversesqrt(max(dot(across, across), 1e-12));
    float to_side = dot(n, across);
    // |n x h|^2 in place of 1 - (n.h)^2, which would cancel.
    vec3 off = cross(n, h);
    float n_dot_h = dot(n, h);
    float tail = max(dot(off, off) - to_side * to_side, 0.0) / ahead + to_side * to_side / aside + n_dot_h * n_dot_h;
    float slant_v = sqrt(square + (1.0 - square) * n_dot_v * n_dot_v);
    float slant_l = sqrt(square + (1.0 - square) * n_dot_l * n_dot_l);
    float shown = 0.5 * n_dot_l / (n_dot_l * slant_v + n_dot_v * slant_l);
    float lobe = shown / (PI * sqrt(ahead * aside) * tail * tail);
    return min(lobe, 1.0 / (PI * radius * radius)) * fresnel_schlick(f0, v_dot_h);
}
