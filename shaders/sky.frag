// The environment behind the surfaces, at the far plane.

#include "environment_input.glsl"

uniform mat3 env_from_ndc;  // columns: per unit of ndc x, per unit of ndc y, straight ahead

in vec2 ndc;
out vec4 color;

void main() {
    vec3 dir_env = normalize(env_from_ndc * vec3(ndc, 1.0));
    color = vec4(environment_radiance(dir_env), 1.0);
}
