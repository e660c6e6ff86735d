// The environment behind the surfaces.

#include "environment_input.glsl"

in vec3 dir_env;
out vec4 color;

void main() {
#if ENVIRONMENT_FOOTPRINT || ENVIRONMENT >= SKY
    // Footprints are angles, and formulas want unit length; a texture takes any.
    color = vec4(environment_radiance(normalize(dir_env)), 1.0);
#else
    color = vec4(environment_radiance(dir_env), 1.0);
#endif
}
