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
    vec3 seen_env = in_room(eye_room, dir_env);
#elif ENVIRONMENT_FOOTPRINT || ENVIRONMENT >= SKY
    // Footprints are angles, and formulas want unit length; a texture takes any.
    vec3 seen_env = normalize(dir_env);
#else
    vec3 seen_env = dir_env;
#endif
    color = vec4(environment_radiance(seen_env, footprint_x(seen_env), footprint_y(seen_env)), 1.0);
#if SHOW == SHOW_REFLECTION
    shown = vec4(world_from_env * normalize(dir_env), 1.0);
#endif
#if SHOW
    color = shown;
#endif
}
