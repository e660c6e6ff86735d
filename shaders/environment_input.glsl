// The environment as this scene and this plan have it. Glue: reads uniforms, dispatches to lib.

#define LATLONG 0
#define CUBE 1
#define HEMICUBE 2
#define OCTAHEDRAL 3
#define EQUAL_AREA 4
#define EQUIDISTANT 5
#define ORTHOGRAPHIC 6
#define PARABOLOID 7
#define SKY 8
#define CHROME 9
#define FRACTAL 10
#define COLOURED 2
#define BY_LONGEST 0
#define BY_AREA 1

#include "show_input.glsl"
#include "lib/environment.glsl"
#include "lib/filter.glsl"

#if ENVIRONMENT < SKY
#if ENVIRONMENT == CUBE
uniform samplerCube environment;
#else
uniform sampler2D environment;
#endif
#if ENVIRONMENT > CUBE
#include "lib/layout.glsl"
uniform vec4 level_place[15];  // of each level: x, y of its corner on the texture; width and height of a tile
#if ENVIRONMENT_FOOTPRINT
uniform int last_level;
#endif
#endif
#if ENVIRONMENT_BORDER
uniform vec4 border;  // texture coordinate = place * xy + zw
#endif
#if ENVIRONMENT_BELOW == COLOURED
uniform vec3 below;
#endif
#if ENVIRONMENT_FOOTPRINT
uniform float texels_per_radian;
#endif
#else
#include "lib/procedural.glsl"
#if ENVIRONMENT == SKY
uniform vec3 up;
uniform vec3 down;
uniform float softness;
#elif ENVIRONMENT == CHROME
uniform vec3 grey;
uniform vec3 silver;
uniform float bands;
uniform float sway;
#elif ENVIRONMENT == FRACTAL
uniform vec3 sky;
uniform vec3 haze;
uniform vec3 rock;
uniform vec3 snow;
uniform float relief;
uniform uint seed;
uniform int steps;
#else
#error "ENVIRONMENT must be one of the names above"
#endif
#endif

#if ENVIRONMENT_FOOTPRINT
uniform float footprint;  // of a sample, in pixels
#endif
#if EXPOSURE
uniform float exposure_factor;
#endif

#if ENVIRONMENT > CUBE && ENVIRONMENT < SKY
vec3 tile_place(vec3 dir_env) {
#if ENVIRONMENT == HEMICUBE
    return hemicube_place(dir_env);
#elif ENVIRONMENT == OCTAHEDRAL
    return octahedral_place(dir_env);
#elif ENVIRONMENT == EQUAL_AREA
    return equal_area_place(dir_env);
#elif ENVIRONMENT == EQUIDISTANT
    return equidistant_place(dir_env);
#elif ENVIRONMENT == ORTHOGRAPHIC
    return orthographic_place(dir_env);
#else
    return paraboloid_place(dir_env);
#endif
}

// Of one level: its tiles lie below each other, each in a border of one texel.
vec3 tile_radiance(vec3 place, int level) {
    vec4 at = level_place[level];
#if ENVIRONMENT_BORDER
    place.yz = place.yz * border.xy + border.zw;
#endif
    vec2 texel = at.xy + tile_texel(place, at.zw);
    READS(1.0);
    return textureLod(environment, texel / vec2(textureSize(environment, 0)), 0.0).rgb;
}
#endif

#if ENVIRONMENT < SKY
// In a direction that the layout shows.
vec3 picture_radiance(vec3 dir_env, float level) {
#if ENVIRONMENT == LATLONG
    vec2 place = latlong_uv(dir_env);
#if ENVIRONMENT_BORDER
    place = place * border.xy + border.zw;
#endif
    READS(1.0);
    return textureLod(environment, place, level).rgb;
#elif ENVIRONMENT == CUBE
#if ENVIRONMENT_BORDER
    dir_env = cube_border_dir(dir_env, border.x);
#endif
    READS(1.0);
    return textureLod(environment, dir_env, level).rgb;
#else
    vec3 place = tile_place(dir_env);
#if ENVIRONMENT_FOOTPRINT
    level = clamp(level, 0.0, float(last_level));
#if ENVIRONMENT_MIX
    int near = int(level);
    vec3 finer = tile_radiance(place, near);
    vec3 coarser = tile_radiance(place, min(near + 1, last_level));
    return mix(finer, coarser, level - float(near));
#else
    return tile_radiance(place, int(ceil(level + 0.5)) - 1);
#endif
#else
    return tile_radiance(place, 0);
#endif
#endif
}
#endif

#if ENVIRONMENT <= CUBE && ENVIRONMENT_FOOTPRINT && ENVIRONMENT_GRADIENTS
// The same over a footprint, by the texture unit's own look-ups along it.
vec3 picture_over(vec3 dir_env, vec3 ddx, vec3 ddy) {
    READS(1.0);
#if ENVIRONMENT == LATLONG
    vec2 place = latlong_uv(dir_env);
    vec2 place_dx = wrapped_difference(latlong_uv(normalize(dir_env + ddx)) - place);
    vec2 place_dy = wrapped_difference(latlong_uv(normalize(dir_env + ddy)) - place);
    return textureGrad(environment, place, place_dx, place_dy).rgb;
#else
    return textureGrad(environment, dir_env, ddx, ddy).rgb;
#endif
}
#endif

// How a direction changes across a sample, from pixel to pixel; 0 where nothing reads it.
vec3 footprint_x(vec3 dir_env) {
#if ENVIRONMENT_FOOTPRINT
    return dFdx(dir_env) * footprint;
#else
    return vec3(0.0);
#endif
}

vec3 footprint_y(vec3 dir_env) {
#if ENVIRONMENT_FOOTPRINT
    return dFdy(dir_env) * footprint;
#else
    return vec3(0.0);
#endif
}

#if ENVIRONMENT < SKY
// At a level, over a footprint.
vec3 leveled_picture(vec3 dir_env, float level, vec3 ddx, vec3 ddy) {
#if SHOW == SHOW_LEVEL
    if (shown.a == 0.0) shown = vec4(level, shown.g, 0.0, 1.0);
#endif
    // Layouts of the upper half show below the horizon what mirrors it above.
    vec3 radiance = picture_radiance(dir_env, level);
#if ENVIRONMENT_BELOW == COLOURED
    radiance = mix(below, radiance, share_above(dir_env.y, ddx.y, ddy.y));
#endif
    return radiance;
}

// Averaged over a footprint that counts as wide as long, but for what direction_level says; or by the texture unit.
vec3 averaged_picture(vec3 dir_env, vec3 ddx, vec3 ddy) {
#if ENVIRONMENT <= CUBE && ENVIRONMENT_FOOTPRINT && ENVIRONMENT_GRADIENTS
    return picture_over(dir_env, ddx, ddy);
#else
#if ENVIRONMENT_FOOTPRINT
    // By the largest texels there are: where a layout's are smaller (near the poles, in a cube's corners) the level is
    // finer than the footprint's. Levels by each texel's own solid angle blur more than that sparkles.
#if ENVIRONMENT_LEVEL == BY_AREA
    float level = direction_level(ddx, ddy, texels_per_radian);
#elif ENVIRONMENT_LEVEL == BY_LONGEST
    float level = longest_level(ddx, ddy, texels_per_radian);
#else
#error "ENVIRONMENT_LEVEL must be BY_LONGEST or BY_AREA"
#endif
#else
    const float level = 0.0;
#endif
    return leveled_picture(dir_env, level, ddx, ddy);
#endif
}
#endif

void show_footprint(vec3 ddx, vec3 ddy) {
#if SHOW == SHOW_FOOTPRINT
    if (shown.a == 0.0) {
        vec3 major, minor;
        footprint_axes(ddx, ddy, major, minor);
        shown = vec4(length(major), length(minor), 0.0, 1.0);
    }
#endif
}

vec3 exposed(vec3 radiance) {
#if EXPOSURE
    return exposure_factor * radiance;
#else
    return radiance;
#endif
}

// dir_env: unit length where it has a footprint or the environment is computed; else of any. ddx, ddy: how it changes
// across the sample.
vec3 environment_radiance(vec3 dir_env, vec3 ddx, vec3 ddy) {
    show_footprint(ddx, ddy);
#if ENVIRONMENT == SKY
    vec3 radiance = sky_radiance(dir_env, ddx, ddy, up, down, softness);
#elif ENVIRONMENT == CHROME
    vec3 radiance = chrome_radiance(dir_env, ddx, ddy, grey, silver, bands, sway);
#elif ENVIRONMENT == FRACTAL
    vec3 radiance = fractal_radiance(dir_env, ddx, ddy, sky, haze, rock, snow, relief, seed, steps);
#elif ENVIRONMENT_FOOTPRINT && ANISOTROPY > 1
    vec3 major, minor;
    footprint_axes(ddx, ddy, major, minor);
    float taps = footprint_taps(major, minor, texels_per_radian, float(ANISOTROPY));
    vec3 step = major / taps;
    vec3 radiance = vec3(0.0);
    for (float i = 0.5 - 0.5 * taps; i < 0.5 * taps; i += 1.0) {
        radiance += averaged_picture(normalize(dir_env + i * step), step, minor) / taps;
    }
#else
    vec3 radiance = averaged_picture(dir_env, ddx, ddy);
#endif
    return exposed(radiance);
}
