// The environment behind the surfaces.

#include "environment_input.glsl"
#if PARALLAX
#include "room.glsl"
uniform vec3 eye_room;
#endif

in vec3 dir_env;
out vec4 color;

void main() {
#if PARALLAX
    color = vec4(environment_radiance(in_room(eye_room, dir_env)), 1.0);
#elif ENVIRONMENT_FOOTPRINT || ENVIRONMENT >= SKY
    // Footprints are angles, and formulas want unit length; a texture takes any.
    color = vec4(environment_radiance(normalize(dir_env)), 1.0);
#else
    color = vec4(environment_radiance(dir_env), 1.0);
#endif
}
