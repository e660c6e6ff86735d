// One pixel of a surface: exact point, bent normal, reflected environment. Glue: reads inputs, dispatches to
// lib, writes. Which parts there are is decided in glbump/plan.py alone.
//
// Shading happens in the environment's frame (names end in _env): the world, moved so that the eye is the
// origin and turned back by the environment's rotation. Both cost nothing here: the matrices carry them.

#define MESH 0
#define SPHERE 1
#define TORUS 2
#define QUAD 3
#define NONE 0
#define ORTHOGONAL 1
#define GENERAL 2
#define BY_POINT 0
#define BY_PIXEL 1
#define REFLECTION 0
#define BY_NORMAL 1
#define WHITE_MIRROR 0
#define TINTED_MIRROR 1
#define SMOOTH 2
#define GLOSSY 3
#define BY_SH9 1
#define BY_MAP 2

#include "environment_input.glsl"
#include "lib/mapping.glsl"
#include "lib/reflect.glsl"
#if BUMP
#include "bump_input.glsl"
#endif
#if PARALLAX
#include "room.glsl"
uniform mat3 room_from_object;
uniform vec3 origin_room;
#endif
#if LIGHT == GLOSSY
#include "gloss_input.glsl"
#endif

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

#if SHAPE == SPHERE
uniform float radius;
#elif SHAPE == TORUS
uniform float radius;
uniform float tube;
#elif SHAPE == QUAD
uniform vec3 corners[4];
#endif

#if LIGHT == TINTED_MIRROR
uniform vec3 f0;
#elif LIGHT == SMOOTH || LIGHT == GLOSSY
uniform vec3 f0;
#if DIFFUSE || TRANSMISSION || LIGHT == GLOSSY
uniform vec3 dielectric_f0;
#endif
#if DIFFUSE
uniform vec3 diffuse_color;
#endif
#if DIFFUSE == BY_SH9
uniform vec3 sh[9];
#elif DIFFUSE == BY_MAP
uniform samplerCube irradiance_map;
#elif DIFFUSE
#error "DIFFUSE must be 0, BY_SH9 or BY_MAP"
#endif
#if SUNS
#include "lib/sun.glsl"
uniform vec3 sun_dir[SUNS];
uniform vec3 sun_irradiance[SUNS];
uniform float sun_radius[SUNS];
#endif
#if TRANSMISSION || LIGHT == GLOSSY
uniform vec3 base_color;
uniform float metallic;
#endif
#if TRANSMISSION
uniform vec3 transmitted_color;
uniform float ior;
#endif
#endif

#if LOG_DEPTH
uniform vec2 log_depth;  // factor, summand
#endif

in vec3 p_object;
#if MULTISAMPLED
// Mesa's llvmpipe (22.3) takes what varies at the sample, and its perspective at the middle of the pixel: all is off by
// one factor, which this shows.
in float one;
#else
const float one = 1.0;
#endif
#if SHAPE == MESH
in vec3 mesh_normal;
#if HAS_UV
in vec2 mesh_uv;
in vec3 mesh_dpdu;
in vec3 mesh_dpdv;
#if BUMP_FULL
in vec3 mesh_dndu;
in vec3 mesh_dndv;
#endif
#endif
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

SurfacePoint surface_point(vec3 p_object, vec3 dir_object) {
    SurfacePoint s;
    s.p_object = p_object;
#if SHAPE == MESH
    // Between vertices whose normals are opposite there is none: 0, and no NaN.
    s.n_object = mesh_normal * inversesqrt(max(dot(mesh_normal, mesh_normal), 1e-30));
#if HAS_UV
    s.uv = mesh_uv / one;
    s.dpdu = mesh_dpdu / one;
    s.dpdv = mesh_dpdv / one;
#if BUMP_FULL
    s.dndu = mesh_dndu / one;
    s.dndv = mesh_dndv / one;
#endif
#endif
#elif SHAPE == SPHERE
#if TWO_SIDED
    // Seen from within, it is entered from behind.
    if (!gl_FrontFacing) dir_object = -dir_object;
#endif
    vec3 p = p_object + sphere_step(p_object, dir_object, radius) * dir_object;
    s.p_object = p;
    s.n_object = p / radius;
#if HAS_UV
    s.uv = sphere_uv(p);
    s.dpdu = sphere_dpdu(p);
    s.dpdv = sphere_dpdv(p);
#if BUMP_FULL
    s.dndu = sphere_dndu(p, radius);
    s.dndv = sphere_dndv(p, radius);
#endif
#endif
#elif SHAPE == TORUS
    vec3 p = p_object + torus_step(p_object, dir_object, radius, tube) * dir_object;
    s.p_object = p;
    s.n_object = torus_normal(p, radius);
#if HAS_UV
    s.uv = torus_uv(p, radius);
    s.dpdu = torus_dpdu(p);
    s.dpdv = torus_dpdv(p, radius);
#if BUMP_FULL
    s.dndu = torus_dndu(p, radius);
    s.dndv = torus_dndv(p, radius);
#endif
#endif
#elif SHAPE == QUAD
    s.n_object = normalize(cross(corners[2] - corners[0], corners[3] - corners[1]));
#if HAS_UV
    s.uv = inverse_bilinear(p_object, corners[0], corners[1], corners[2], corners[3]);
    s.dpdu = bilinear_dpdu(s.uv, corners[0], corners[1], corners[2], corners[3]);
    s.dpdv = bilinear_dpdv(s.uv, corners[0], corners[1], corners[2], corners[3]);
#endif
#else
#error "SHAPE must be MESH, SPHERE, TORUS or QUAD"
#endif
    return s;
}

#if BUMP && HAS_WORLD
// Of the height's slopes by u and v.
vec3 gradient_by_uv(vec3 n_env, vec3 dpdu, vec3 dpdv, vec2 slope) {
#if (SHAPE == SPHERE || SHAPE == TORUS) && TRANSFORM != GENERAL
    return orthogonal_gradient(dpdu, dpdv, slope);
#else
    return surface_gradient(n_env, dpdu, dpdv, slope);
#endif
}
#endif

#if BUMP
// The bent normal; and round it the spread of normals that are not seen one by one, in slopes against it.
Varied bumped(SurfacePoint s, Varied p_met, Varied n, out Varied around) {
    vec3 n_env = n.at;
    Place at;
#if HAS_UV
    at.uv = s.uv;
    at.uv_dx = at.uv_dy = vec2(0.0);
#if BUMP_MIP && SHAPE == MESH
    at.uv_dx = dFdx(s.uv);
    at.uv_dy = dFdy(s.uv);
#elif BUMP_MIP
    at.uv_dx = uv_change(p_met.dx, s.dpdu, s.dpdv);
    at.uv_dy = uv_change(p_met.dy, s.dpdu, s.dpdv);
#endif
    vec3 dpdu = turned(s.dpdu);
    vec3 dpdv = turned(s.dpdv);
#endif
#if HAS_TRIPLANAR
    at.p = s.p_object;
    at.n = s.n_object;
    at.p_dx = p_met.dx;
    at.p_dy = p_met.dy;
#if TRANSFORM == GENERAL
    mat3 gradient_matrix = env_from_object_gradient;
#elif TRANSFORM == ORTHOGONAL
    mat3 gradient_matrix = env_from_object;
#else
    const mat3 gradient_matrix = mat3(1.0);
#endif
#endif
#if SPREAD
    // Of gradients, along two axes of the tangent plane.
    vec3 x, y, moments = vec3(0.0);
    axes_across(n_env, x, y);
#if HAS_TRIPLANAR
    at.x = x * gradient_matrix;
    at.y = y * gradient_matrix;
#endif
#endif
    Relief relief = relief_at(at);
    vec3 gradient = vec3(0.0);
#if HAS_NORMALS
    vec3 t, b;
    tangent_frame(n_env, dpdu, dpdv, t, b);
    gradient += relief.by_tangent.x * t + relief.by_tangent.y * b;
#if SPREAD
    moments += moments_across(x, y, t, b, relief.spread_by_tangent);
#endif
#endif
#if HAS_PARAMETER
    gradient += invariant_gradient(n_env, dpdu, dpdv, relief.by_parameter);
#if SPREAD
    // By the lengths of slopes along u and v alone, which is right to their sum.
    moments += moments_across(x, y, invariant_gradient(n_env, dpdu, dpdv, vec2(1.0, 0.0)),
                              invariant_gradient(n_env, dpdu, dpdv, vec2(0.0, 1.0)), relief.spread_by_parameter);
#endif
#endif
#if HAS_WORLD
#if BUMP_FULL
    dpdu += relief.height * turned_change(s.dndu, s.n_object);
    dpdv += relief.height * turned_change(s.dndv, s.n_object);
#endif
    gradient += gradient_by_uv(n_env, dpdu, dpdv, relief.by_uv);
#if SPREAD
    moments += moments_across(x, y, gradient_by_uv(n_env, dpdu, dpdv, vec2(1.0, 0.0)),
                              gradient_by_uv(n_env, dpdu, dpdv, vec2(0.0, 1.0)), relief.spread_by_uv);
#endif
#endif
#if HAS_TRIPLANAR
    gradient += volume_gradient(n_env, gradient_matrix * relief.by_object);
#if SPREAD
    moments += relief.spread_by_object;
#endif
#endif
#if HAS_SCREEN
    gradient += surface_gradient_screen(n_env, turned(s.p_object), relief.on_screen);
#endif
#if SHOW == SHOW_SLOPE
    shown = vec4(world_from_env * gradient, 1.0);
#endif
    Varied result = bent(n, gradient);
    around = Varied(result.at, vec3(0.0), vec3(0.0));
#if SPREAD
    spread_along(x, y, moments, x, y);
    around.dx = bump_normal_change(n_env, gradient, vec3(0.0), x);
    around.dy = bump_normal_change(n_env, gradient, vec3(0.0), y);
#endif
    return result;
}
#endif

#if SPREAD && LIGHT != GLOSSY
#if ENVIRONMENT < SKY
// A level's texel is averaged by the box that it covers and by the tent between texels: 1/12 + 1/6 of its square.
const float SPREAD_SIDE = 2.0;
#else
// What is computed is averaged over the footprint itself, of which the variance is 1/12.
const float SPREAD_SIDE = 3.46410161513775458705;
#endif

// Radiance about dir_env, over a footprint as widened_footprint has it.
vec3 spread_radiance(vec3 dir_env, vec3 longer, vec3 shorter, vec2 squares) {
    vec3 ddx = sqrt(squares.x) * longer, ddy = sqrt(squares.y) * shorter;
#if SPREAD == LEAN && ENVIRONMENT < SKY
    show_footprint(ddx, ddy);
    vec2 taps = spread_taps(squares, texels_per_radian);
    ddx = taps.y * longer;
    ddy = taps.y * shorter;
    float level = longest_level(ddx, ddy, texels_per_radian);  // of what is round, by area the same
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SPREAD_TAPS; i++) {
        float place = taps.x * (float(i) - 0.5 * float(SPREAD_TAPS - 1));
        sum += leveled_picture(dir_env + place * longer, level, ddx, ddy);
    }
    return exposed(sum / float(SPREAD_TAPS));
#else
    return environment_radiance(dir_env, ddx, ddy);
#endif
}
#endif

// Radiance from look at a point of the surface; p_room is looked at where there is a room. around: spread of the
// directions that are looked at together, beside those of the sample's footprint. Past what is near in a room it is taken
// as if all of the room were far. rough: roughness where a chain is read.
vec3 mirrored(Varied p_room, Varied look, Varied around, float rough) {
    vec3 dir_env = look.at;
    vec3 ddx = vec3(0.0), ddy = vec3(0.0);
#if ENVIRONMENT_FOOTPRINT
    ddx = footprint * look.dx;
    ddy = footprint * look.dy;
#endif
#if PARALLAX
    vec3 seen_env = in_room(p_room.at, dir_env);
#if ENVIRONMENT_FOOTPRINT
    ddx = in_room(p_room.at + footprint * p_room.dx, dir_env + ddx) - seen_env;
    ddy = in_room(p_room.at + footprint * p_room.dy, dir_env + ddy) - seen_env;
#endif
    dir_env = seen_env;
#endif
#if LIGHT == GLOSSY && GLOSS == CHAIN
    return blurred_radiance(dir_env, rough);
#else
#if SPREAD && LIGHT != GLOSSY
    vec3 longer, shorter;
    vec2 squares;
    widened_footprint(dir_env, ddx, ddy, SPREAD_SIDE * around.dx, SPREAD_SIDE * around.dy, longer, shorter, squares);
    return spread_radiance(dir_env, longer, shorter, squares);
#else
    return environment_radiance(dir_env, ddx, ddy);
#endif
#endif
}

#if DIFFUSE
vec3 irradiance_over_pi(vec3 n_env) {
#if DIFFUSE == BY_SH9
    vec3 irradiance = sh9_irradiance(n_env, sh);
#else
    vec3 irradiance = textureLod(irradiance_map, n_env, 0.0).rgb;
#endif
#if SUNS
    for (int i = 0; i < SUNS; i++) irradiance += max(dot(n_env, sun_dir[i]), 0.0) * INV_PI * sun_irradiance[i];
#endif
#if EXPOSURE
    irradiance *= exposure_factor;
#endif
    return irradiance;
}
#endif

#if SUNS && LIGHT == GLOSSY && GLOSS == CHAIN
// Of the suns that the chain is without, once reflected.
vec3 suns_mirrored(vec3 v_env, vec3 n_env, float rough) {
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < SUNS; i++) {
        radiance += sun_irradiance[i] * sun_reflected(n_env, v_env, sun_dir[i], sun_radius[i], rough, f0);
    }
#if EXPOSURE
    radiance *= exposure_factor;
#endif
    return radiance;
}
#endif

// dir mirrored at n, and bent there.
Varied reflection(Varied dir, Varied n) {
    return Varied(reflect_dir(dir.at, n.at), reflect_dir_change(dir.at, n.at, dir.dx, n.dx),
                  reflect_dir_change(dir.at, n.at, dir.dy, n.dy));
}

Varied refraction(Varied dir, Varied n, float eta) {
    return Varied(refract_dir(dir.at, n.at, eta), refract_dir_change(dir.at, n.at, eta, dir.dx, n.dx),
                  refract_dir_change(dir.at, n.at, eta, dir.dy, n.dy));
}

// A normal on the eye's side, and a direction on the side of n.
Varied kept_facing(Varied n, Varied dir) {
    Varied over = reflection(n, dir);
    bool is_facing = dot(n.at, dir.at) <= 0.0;
    return Varied(facing(n.at, dir.at), is_facing ? n.dx : over.dx, is_facing ? n.dy : over.dy);
}

Varied kept_above(Varied dir, Varied n) {
    Varied over = reflection(dir, n);
    bool is_above = dot(dir.at, n.at) >= 0.0;
    return Varied(above_surface(dir.at, n.at), is_above ? dir.dx : over.dx, is_above ? dir.dy : over.dy);
}

#if SPREAD
// Directions with a spread, of which none goes through the plane whose normal is n.
Varied folded(Varied around, vec3 n) {
    Varied result;
    folded(around.at, n, around.dx, around.dy, result.at, result.dx, result.dy);
    return result;
}
#endif

// geometry: the normal of the surface without its bumps, on the eye's side. eta: index of refraction on the eye's
// side over that on the other. around: n with its spread, in slopes.
vec3 light(Varied p_room, Varied dir, Varied n, Varied geometry, float eta, Varied around) {
    vec3 dir_env = dir.at, n_env = n.at;
    Varied look_around = around;
#if SPREAD && LIGHT == GLOSSY
    float rough = spread_roughness(roughness, around.dx, around.dy);
#elif LIGHT == GLOSSY
    float rough = roughness;
#else
    const float rough = 0.0;
#endif
#if SPREAD && LIGHT != GLOSSY
    float unit = unit_share(around.dx, around.dy);
    around = Varied(n_env, unit * around.dx, unit * around.dy);
    Varied still = Varied(dir_env, vec3(0.0), vec3(0.0));
#endif
#if LOOKUP == REFLECTION
    Varied look = reflection(dir, n);
#if SPREAD && LIGHT != GLOSSY
    look_around = folded(reflection(still, around), geometry.at);
    look.at = look_around.at;
#elif BUMP
    look = kept_above(look, geometry);
#endif
#elif LOOKUP == BY_NORMAL
    Varied look = n;
    look_around = around;
#else
#error "LOOKUP must be REFLECTION or BY_NORMAL"
#endif
#if SHOW == SHOW_REFLECTION
    shown = vec4(world_from_env * look.at, 1.0);
#endif
    float n_dot_v = -dot(dir_env, n_env);
#if LIGHT == WHITE_MIRROR
    return mirrored(p_room, look, look_around, rough);
#elif LIGHT == TINTED_MIRROR
    return fresnel_schlick(f0, n_dot_v) * mirrored(p_room, look, look_around, rough);
#elif LIGHT == SMOOTH || LIGHT == GLOSSY
#if LIGHT == GLOSSY
    vec2 factors = lobe_factors(n_dot_v, rough);
    vec3 dielectric = glossy_share(dielectric_f0, factors);
    vec3 share = mix(dielectric, glossy_share(base_color, factors), metallic);
#if DIFFUSE || TRANSMISSION
    vec3 kept = 1.0 - dielectric;
#endif
#if TRANSMISSION
    // All of it from the critical angle on, which a fit of smooth curves does not know.
    float all = step(1.0, fresnel_dielectric(n_dot_v, eta)) * (1.0 - metallic);
    share = mix(share, vec3(1.0), all);
    kept *= 1.0 - all;
#endif
#elif TRANSMISSION
    float reflected = fresnel_dielectric(n_dot_v, eta);
    vec3 share = mix(vec3(reflected), fresnel_schlick(base_color, n_dot_v), metallic);
    vec3 kept = vec3(1.0 - reflected);
#else
    vec3 share = fresnel_schlick(f0, n_dot_v);
#if DIFFUSE
    vec3 kept = 1.0 - fresnel_schlick(dielectric_f0, n_dot_v);
#endif
#endif
#if LIGHT == GLOSSY && GLOSS == SAMPLED
    vec3 through_env = refract_dir(dir_env, n_env, eta);
#if LOOKUP == BY_NORMAL
    LobeLight lobe = lobe_light(p_room.at, n_env, n_env, geometry.at, rough, f0, eta, look.at, through_env);
#if TRANSMISSION
    lobe.through =
        lobe_light(p_room.at, -dir_env, n_env, geometry.at, rough, f0, eta, look.at, through_env).through;
#endif
#else
    LobeLight lobe = lobe_light(p_room.at, -dir_env, n_env, geometry.at, rough, f0, eta, look.at, through_env);
#endif
    vec3 result = share * lobe.mirrored;
#elif LIGHT == GLOSSY
    vec3 result = share * mirrored(p_room, Varied(lobe_dir(n_env, look.at, rough), look.dx, look.dy), look_around, rough);
#if SUNS
    // What a facet scatters on counts as share has it, at every angle of the sun.
    vec3 scattered = share / max(f0 * factors.x + factors.y, 1e-6);
    result += scattered * suns_mirrored(-dir_env, n_env, rough);
#endif
#else
    vec3 result = share * mirrored(p_room, look, look_around, rough);
#endif
#if DIFFUSE
    result += kept * diffuse_color * irradiance_over_pi(n_env);
#endif
#if TRANSMISSION && LIGHT == GLOSSY && GLOSS == SAMPLED
    result += kept * transmitted_color * lobe.through;
#elif TRANSMISSION
    Varied through = refraction(dir, n, eta);
    Varied through_around = around;
#if SPREAD && LIGHT != GLOSSY
    through_around = folded(refraction(still, around, eta), -geometry.at);
    through.at = through_around.at;
#elif BUMP
    through = kept_above(through, Varied(-geometry.at, -geometry.dx, -geometry.dy));
#endif
    result += kept * transmitted_color * mirrored(p_room, through, through_around, rough);
#endif
    return result;
#else
#error "LIGHT must be WHITE_MIRROR, TINTED_MIRROR, SMOOTH or GLOSSY"
#endif
}

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
    Varied around;
    n = bumped(s, p_met, n, around);
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
    color = vec4(light(p_room, dir, n, geometry, eta, around), 1.0);
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
