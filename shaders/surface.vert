// Positions to clip space; what a mesh carries goes on to the fragments, analytic shapes carry nothing.

#define MESH 0

uniform mat4 clip_from_object;
#if OUTLINE
uniform mat4 object_from_outline;
#endif

in vec3 position;
out vec3 p_object;
#if MULTISAMPLED
out float one;
#endif

#if SHAPE == MESH
in vec3 normal;
out vec3 mesh_normal;
#if HAS_UV
in vec2 texcoord;
in vec3 tangent_u;
in vec3 tangent_v;
#if BUMP_FULL
in vec3 normal_u;
in vec3 normal_v;
out vec3 mesh_dndu;
out vec3 mesh_dndv;
#endif
out vec2 mesh_uv;
out vec3 mesh_dpdu;
out vec3 mesh_dpdv;
#endif
#endif

void main() {
#if OUTLINE
    p_object = vec3(object_from_outline * vec4(position, 1.0));
#else
    p_object = position;
#endif
#if SHAPE == MESH
    mesh_normal = normal;
#if HAS_UV
    mesh_uv = texcoord;
    mesh_dpdu = tangent_u;
    mesh_dpdv = tangent_v;
#if BUMP_FULL
    mesh_dndu = normal_u;
    mesh_dndv = normal_v;
#endif
#endif
#endif
#if MULTISAMPLED
    // Not a constant: that would be no varying any more.
    one = position.x > 1e30 ? 0.0 : 1.0;
#endif
    gl_Position = clip_from_object * vec4(p_object, 1.0);
}
