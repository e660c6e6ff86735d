// How a surface and what it mirrors change from pixel to pixel. Glue for lib/footprint.glsl.

#include "lib/footprint.glsl"
#include "shape_input.glsl"

// A vector, and its changes with a pixel to the right and with one up; nothing reads these where nothing has a footprint.
struct Varied {
    vec3 at;
    vec3 dx;
    vec3 dy;
};

#define FOOTPRINT (ENVIRONMENT_FOOTPRINT || BUMP_MIP)

#if FOOTPRINT
uniform vec3 pixel_x;  // change of an object's point at depth 1 (orthographic: at any) with a pixel to the right
uniform vec3 pixel_y;  // with one up
uniform vec3 depth_change;  // of the depth, with the object's point; 0: orthographic
#endif

// Where rays along dir_object meet the surface.
Varied point_met(SurfacePoint s, vec3 dir_object) {
#if FOOTPRINT && SHAPE == MESH
    return Varied(s.p_object, dFdx(s.p_object), dFdy(s.p_object));
#elif FOOTPRINT
    float depth = 1.0 / gl_FragCoord.w + dot(depth_change, s.p_object - p_object / one);
    vec3 x = depth * pixel_x, y = depth * pixel_y;
    // Half a pixel inside a round outline the cosine is the root of a pixel in radii, and no pixel has a smaller mean.
#if SHAPE == SPHERE
    float least = sqrt(0.25 * max(length(x), length(y)) / radius);
#elif SHAPE == TORUS
    float least = sqrt(0.25 * max(length(x), length(y)) / tube);
#else
    const float least = LEAST_COSINE;
#endif
    return Varied(s.p_object, hit_change(x, dir_object, s.n_object, least), hit_change(y, dir_object, s.n_object, least));
#else
    return Varied(s.p_object, vec3(0.0), vec3(0.0));
#endif
}

#if FOOTPRINT
vec3 ray_change(vec3 dir_object, vec3 dir_env, vec3 pixel) {
#if TRANSFORM == GENERAL
    vec3 change = env_from_object * pixel / length(env_from_object * dir_object);
#else
    vec3 change = turned(pixel);
#endif
    return (change - dir_env * dot(dir_env, change)) * dot(depth_change, dir_object);
}

vec3 normal_change(SurfacePoint s, vec3 dp) {
#if SHAPE == SPHERE
    return turned_change(dp / radius, s.n_object);
#elif SHAPE == TORUS
    return turned_change(torus_normal_change(s.p_object, dp, radius), s.n_object);
#else
    return vec3(0.0);
#endif
}
#endif

// The direction of rays.
Varied looking(vec3 dir_object, vec3 dir_env) {
#if FOOTPRINT
    return Varied(dir_env, ray_change(dir_object, dir_env, pixel_x), ray_change(dir_object, dir_env, pixel_y));
#else
    return Varied(dir_env, vec3(0.0), vec3(0.0));
#endif
}

// The normal without bumps.
Varied normal_met(SurfacePoint s, Varied p_object, vec3 n_env) {
#if FOOTPRINT && SHAPE == MESH
    return Varied(n_env, dFdx(n_env), dFdy(n_env));
#elif FOOTPRINT
    return Varied(n_env, normal_change(s, p_object.dx), normal_change(s, p_object.dy));
#else
    return Varied(n_env, vec3(0.0), vec3(0.0));
#endif
}
