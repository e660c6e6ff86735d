// The light that a surface sends to the eye: what it reflects, refracts and scatters. Glue: reads uniforms, dispatches to
// lib.

#define REFLECTION 0
#define BY_NORMAL 1
#define WHITE_MIRROR 0
#define TINTED_MIRROR 1
#define SMOOTH 2
#define GLOSSY 3
#define BY_SH9 1
#define BY_MAP 2

#include "lib/reflect.glsl"
#include "environment_input.glsl"
#include "footprint_input.glsl"
#if PARALLAX
#include "room.glsl"
uniform mat3 room_from_object;
uniform vec3 origin_room;
#endif
#if LIGHT == GLOSSY
#include "gloss_input.glsl"
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

#if SPREAD && LIGHT != GLOSSY
#if ENVIRONMENT < SKY
// A level's texel is averaged by the box that it covers and by the tent between texels: 1/12 + 1/6 of its square.
const float SPREAD_SIDE = 2.0;
#else
// What is computed is averaged over the footprint itself, of which the variance is 1/12.
const float SPREAD_SIDE = 3.46410161513775458705;
#endif

// Radiance about dir_env, over a footprint as widened_footprint has it. tapped: by more than one look-up.
vec3 spread_radiance(vec3 dir_env, vec3 longer, vec3 shorter, vec2 squares, const bool tapped) {
    vec3 ddx = sqrt(squares.x) * longer, ddy = sqrt(squares.y) * shorter;
#if ENVIRONMENT < SKY
    if (tapped) {
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
    }
#endif
    return environment_radiance(dir_env, ddx, ddy);
}
#endif

// Radiance from look at a point of the surface; p_room is looked at where there is a room. around: spread of the
// directions that are looked at together, beside those of the sample's footprint; tapped: by more than one look-up. Past
// what is near in a room it is taken as if all of the room were far. rough: roughness where a chain is read.
vec3 mirrored(Varied p_room, Varied look, Varied around, float rough, const bool tapped) {
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
    return spread_radiance(dir_env, longer, shorter, squares, tapped);
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
// side over that on the other. around: n with its spread, in slopes; tapped: whether that is worth more than one look-up.
vec3 light(Varied p_room, Varied dir, Varied n, Varied geometry, float eta, Varied around, const bool tapped) {
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
    return mirrored(p_room, look, look_around, rough, tapped);
#elif LIGHT == TINTED_MIRROR
    return fresnel_schlick(f0, n_dot_v) * mirrored(p_room, look, look_around, rough, tapped);
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
    look.at = lobe_dir(n_env, look.at, rough);
    vec3 result = share * mirrored(p_room, look, look_around, rough, tapped);
#if SUNS
    // What a facet scatters on counts as share has it, at every angle of the sun.
    vec3 scattered = share / max(f0 * factors.x + factors.y, 1e-6);
    result += scattered * suns_mirrored(-dir_env, n_env, rough);
#endif
#else
    vec3 result = share * mirrored(p_room, look, look_around, rough, tapped);
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
    result += kept * transmitted_color * mirrored(p_room, through, through_around, rough, tapped);
#endif
    return result;
#else
#error "LIGHT must be WHITE_MIRROR, TINTED_MIRROR, SMOOTH or GLOSSY"
#endif
}
