// The environment as this scene and this plan have it. Glue: reads uniforms, dispatches to lib.

#define LATLONG 0
#define CUBE 1
#define SKY 2
#define CHROME 3
#define FRACTAL 4

#include "lib/environment.glsl"
#include "lib/filter.glsl"

#if ENVIRONMENT == LATLONG || ENVIRONMENT == CUBE
#if ENVIRONMENT == LATLONG
uniform sampler2D environment;
#else
uniform samplerCube environment;
#endif
#if ENVIRONMENT_BORDER
uniform vec4 border;  // lat-long: texture coordinate = uv * xy + zw; cube: x = (N - 1) / N
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
#error "ENVIRONMENT must be LATLONG, CUBE, SKY, CHROME or FRACTAL"
#endif
#endif

#if ENVIRONMENT_FOOTPRINT
uniform float footprint;  // of a sample, in pixels
#endif
#if EXPOSURE
uniform float exposure_factor;
#endif

// dir_env: unit length where it has a footprint or the environment is computed; else of any.
vec3 environment_radiance(vec3 dir_env) {
#if ENVIRONMENT_FOOTPRINT
    vec3 ddx = dFdx(dir_env) * footprint;
    vec3 ddy = dFdy(dir_env) * footprint;
#else
    const vec3 ddx = vec3(0.0);
    const vec3 ddy = vec3(0.0);
#endif
#if ENVIRONMENT == SKY
    vec3 radiance = sky_radiance(dir_env, ddx, ddy, up, down, softness);
#elif ENVIRONMENT == CHROME
    vec3 radiance = chrome_radiance(dir_env, ddx, ddy, grey, silver, bands, sway);
#elif ENVIRONMENT == FRACTAL
    vec3 radiance = fractal_radiance(dir_env, ddx, ddy, sky, haze, rock, snow, relief, seed, steps);
#else
#if ENVIRONMENT_FOOTPRINT
    float level = direction_level(ddx, ddy, texels_per_radian);
#else
    const float level = 0.0;
#endif
#if ENVIRONMENT == LATLONG
    vec2 place = latlong_uv(dir_env);
#if ENVIRONMENT_BORDER
    place = place * border.xy + border.zw;
#endif
#else
    vec3 place = dir_env;
#if ENVIRONMENT_BORDER
    place = cube_border_dir(dir_env, border.x);
#endif
#endif
    vec3 radiance = textureLod(environment, place, level).rgb;
#endif
#if EXPOSURE
    radiance *= exposure_factor;
#endif
    return radiance;
}
