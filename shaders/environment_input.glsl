// The environment as this scene and this plan have it. Glue: reads uniforms, dispatches to lib.

#define LATLONG 0
#define CUBE 1

#include "lib/environment.glsl"
#include "lib/filter.glsl"

#if ENVIRONMENT == LATLONG
uniform sampler2D environment;
#elif ENVIRONMENT == CUBE
uniform samplerCube environment;
#else
#error "ENVIRONMENT must be LATLONG or CUBE"
#endif

#if ENVIRONMENT_BORDER
uniform vec4 border;  // lat-long: texture coordinate = uv * xy + zw; cube: x = (N - 1) / N
#endif
#if ENVIRONMENT_MIP
uniform float texels_per_radian;
uniform float footprint;  // of a sample, in pixels
#endif
#if EXPOSURE
uniform float exposure_factor;
#endif

vec3 environment_radiance(vec3 dir_env) {
#if ENVIRONMENT_MIP
    float level = direction_level(dFdx(dir_env) * footprint, dFdy(dir_env) * footprint, texels_per_radian);
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
#if EXPOSURE
    radiance *= exposure_factor;
#endif
    return radiance;
}
