// One triangle over the whole target, at the far plane, with the direction that each pixel looks along.

uniform mat3 env_from_ndc;  // columns: per unit of ndc x, per unit of ndc y, straight ahead

out vec3 dir_env;

void main() {
    vec2 ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    dir_env = env_from_ndc * vec3(ndc, 1.0);
    gl_Position = vec4(ndc, 1.0, 1.0);
}
