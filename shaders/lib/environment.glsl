// Directions to places in an environment picture. Twin: glbump/reference/environment.py.
// Directions are in the environment's frame: the world turned back by the environment's rotation.

#include "direction.glsl"

const float INV_PI = 0.31830988618379067154;

// Place in a latitude-longitude picture: centre -Z, v down. No asin or acos: near the poles, and on drivers
// whose asin is coarse, atan keeps 3.5e-6 rad. dir_env need not be unit length. Straight up and down u is 1/2:
// GLSL leaves atan(0, 0) undefined, and drivers differ.
vec2 latlong_uv(vec3 dir_env) {
    float ahead = dir_env.x == 0.0 && dir_env.z == 0.0 ? 1.0 : -dir_env.z;
    return vec2(0.5 + 0.5 * INV_PI * atan(dir_env.x, ahead),
                0.5 - INV_PI * atan(dir_env.y, length(dir_env.xz)));
}

// Inverse of latlong_uv; unit length.
vec3 latlong_dir(vec2 uv) {
    float longitude = (uv.x - 0.5) / (0.5 * INV_PI);
    float latitude = (0.5 - uv.y) / INV_PI;
    return vec3(cos(latitude) * sin(longitude), sin(latitude), -cos(latitude) * cos(longitude));
}

// Direction through texel coordinates s (right), t (down), 0..1, of face 0..5 = +X -X +Y -Y +Z -Z: the OpenGL
// table (OpenGL 4.6, table 8.19). Not normalised: its largest component is 1.
vec3 cube_dir(int face, vec2 st) {
    vec2 q = 2.0 * st - 1.0;
    if (face == 0) return vec3(1.0, -q.y, -q.x);
    if (face == 1) return vec3(-1.0, -q.y, q.x);
    if (face == 2) return vec3(q.x, 1.0, q.y);
    if (face == 3) return vec3(q.x, -1.0, -q.y);
    if (face == 4) return vec3(q.x, -q.y, 1.0);
    return vec3(-q.x, -q.y, -1.0);
}

// Direction to look up in a cube whose outermost samples lie on the border of each face (OpenEXR):
// `inset` = (N - 1) / N shrinks the two minor axes, and leaves the largest component 1.
vec3 cube_border_dir(vec3 dir_env, float inset) {
    vec3 a = abs(dir_env);
    float largest = max(a.x, max(a.y, a.z));
    vec3 d = dir_env / largest;
    vec3 shrunk = d * inset;
    return vec3(a.x == largest ? d.x : shrunk.x,
                a.x != largest && a.y == largest ? d.y : shrunk.y,
                a.x != largest && a.y != largest ? d.z : shrunk.z);
}

// Irradiance / pi towards n_env from the nine coefficients of maps/diffuse.py sh9 (Ramamoorthi and Hanrahan
// 2001, equation 13): a constant environment gives itself. Never negative: a sun's lobe undershoots.
vec3 sh9_irradiance(vec3 n_env, vec3 sh[9]) {
    vec3 n = n_env;
    vec3 e = sh[0] + sh[1] * n.y + sh[2] * n.z + sh[3] * n.x
           + sh[4] * (n.x * n.y) + sh[5] * (n.y * n.z) + sh[6] * (3.0 * n.z * n.z - 1.0)
           + sh[7] * (n.x * n.z) + sh[8] * (n.x * n.x - n.y * n.y);
    return max(e, vec3(0.0));
}
