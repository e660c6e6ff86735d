// One pixel of a surface: exact point, bent normal, reflected environment. Glue: reads inputs, dispatches to
// lib, writes. Which parts there are is decided in glbump/plan alone.
//
// Shading happens in the environment's frame (names end in _env): the world, moved so that the eye is the
// origin and turned back by the environment's rotation. Both cost nothing here: the matrices carry them.

#define NONE 0
#define ORTHOGONAL 1
#define GENERAL 2
#define BY_POINT 0
#define BY_PIXEL 1
// What is kept of slopes that levels average: one variance for all directions, or their second moments.
#define TOKSVIG 1
#define LEAN 2

#include "environment_input.glsl"
#include "shape_input.glsl"

#if DIRECTION == BY_POINT
uniform vec4 eye_object;  // w = 1: where the eye is; w = 0: the direction of view (orthographic)
#elif DIRECTION == BY_PIXEL
// Columns: change of the view direction with a pixel to the right, with one up; direction at the picture's centre.
// Close to a surface, nothing but rounding would be left of p_object - eye.
uniform mat3 object_from_pixel;
uniform vec2 picture_centre;
#else
#error "DIRECTION must be BY_POINT or BY_PIXEL"
#endif
// NONE: the surface stands as the environment does. ORTHOGONAL: turned (its size is in its other uniforms).
// GENERAL: stretched.
#if TRANSFORM == ORTHOGONAL || TRANSFORM == GENERAL
uniform mat3 env_from_object;
#endif
#if TRANSFORM == GENERAL
uniform mat3 env_from_object_normal;
#if HAS_TRIPLANAR
uniform mat3 env_from_object_gradient;  // the same, of the length that gradients have
#endif
#endif

#if LOG_DEPTH
uniform vec2 log_depth;  // factor, summand
#endif

out vec4 color;

vec3 turned(vec3 v_object) {
#if TRANSFORM == NONE
    return v_object;
#elif TRANSFORM == ORTHOGONAL || TRANSFORM == GENERAL
    return env_from_object * v_object;
#else
#error "TRANSFORM must be NONE, ORTHOGONAL or GENERAL"
#endif
}

#if BUMP_FULL || ENVIRONMENT_FOOTPRINT || BUMP_MIP
// How the normal of the surface as the environment has it changes, where the object's changes by dn.
vec3 turned_change(vec3 dn, vec3 n_object) {
#if TRANSFORM == GENERAL
    // Of a normalised vector: across it, over its length.
    vec3 n = env_from_object_normal * n_object;
    vec3 change = env_from_object_normal * dn;
    float square = dot(n, n);
    return (change - n * (dot(n, change) / square)) * inversesqrt(square);
#else
    return turned(dn);
#endif
}
#endif

#include "footprint_input.glsl"
#if BUMP
#include "bumped.glsl"
#endif
#include "light_input.glsl"

void main() {
    vec3 p = p_object / one;
#if DIRECTION == BY_POINT
    vec3 dir_object = eye_object.w > 0.5 ? normalize(p - eye_object.xyz) : eye_object.xyz;
#else
    vec3 dir_object = normalize(object_from_pixel * vec3(gl_FragCoord.xy - picture_centre, 1.0));
#endif
    SurfacePoint s = surface_point(p, dir_object);
#if TRANSFORM == GENERAL
    vec3 dir_env = normalize(env_from_object * dir_object);
    vec3 n_env = normalize(env_from_object_normal * s.n_object);
#else
    vec3 dir_env = turned(dir_object);
    vec3 n_env = turned(s.n_object);
#endif
    Varied p_met = point_met(s, dir_object);
    Varied dir = looking(dir_object, dir_env);
    Varied n = normal_met(s, p_met, n_env);
    Varied geometry = n;
#if BUMP
    Varied around, flat_around;
    float share;
    n = bumped(s, p_met, n, around, share, flat_around);
#else
    Varied around = Varied(n_env, vec3(0.0), vec3(0.0));
#endif
#if TWO_SIDED
    // The bump belongs to the outer side; seen from behind, the whole bent surface is turned over.
    float side = dot(n_env, dir_env) > 0.0 ? -1.0 : 1.0;
    geometry = Varied(side * geometry.at, side * geometry.dx, side * geometry.dy);
    n = Varied(side * n.at, side * n.dx, side * n.dy);
#endif
#if BUMP
    n = kept_facing(n, dir);
#endif
#if TRANSMISSION
    float eta = 1.0 / ior;
#if TWO_SIDED
    if (side < 0.0) eta = ior;
#endif
#else
    const float eta = 1.0;
#endif
#if PARALLAX
    Varied p_room = Varied(room_from_object * p_met.at + origin_room, room_from_object * p_met.dx,
                           room_from_object * p_met.dy);
#else
    Varied p_room = p_met;
#endif
    vec3 radiance = light(p_room, dir, n, geometry, eta, around, SPREAD == LEAN);
#if FLATS
    // The others' spread is small.
    if (share < 1.0) {
        vec3 of_flats = light(p_room, dir, geometry, geometry, eta, flat_around, false);
        radiance = mix(of_flats, radiance, share);
    }
#endif
    color = vec4(radiance, 1.0);
#if SHOW == SHOW_NORMAL
    shown = vec4(world_from_env * n.at, 1.0);
#elif SHOW == SHOW_UV && HAS_UV
    shown = vec4(s.uv, 0.0, 1.0);
#elif SHOW == SHOW_SLOPE && !BUMP
    shown.a = 1.0;
#endif
#if SHOW
    color = shown;
#endif
#if LOG_DEPTH
    gl_FragDepth = log_depth.x * log2(gl_FragCoord.w) + log_depth.y;
#endif
}
