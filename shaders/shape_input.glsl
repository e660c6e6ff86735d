// Shapes, and the point of one that a pixel shows. Glue for lib/mapping.glsl: reads uniforms and what varies,
// dispatches to lib.

#define MESH 0
#define SPHERE 1
#define TORUS 2
#define QUAD 3

#include "lib/mapping.glsl"

#if SHAPE == SPHERE
uniform float radius;
#elif SHAPE == TORUS
uniform float radius;
uniform float tube;
#elif SHAPE == QUAD
uniform vec3 corners[4];
#endif

in vec3 p_object;
#if MULTISAMPLED
// Mesa's llvmpipe (22.3) takes what varies at the sample, and its perspective at the middle of the pixel: all is off by
// one factor, which this shows.
in float one;
#else
const float one = 1.0;
#endif
#if SHAPE == MESH
in vec3 mesh_normal;
#if HAS_UV
in vec2 mesh_uv;
in vec3 mesh_dpdu;
in vec3 mesh_dpdv;
#if BUMP_FULL
in vec3 mesh_dndu;
in vec3 mesh_dndv;
#endif
#endif
#endif

// A point of a surface, in the object's frame.
struct SurfacePoint {
    vec3 p_object;
    vec3 n_object;
#if HAS_UV
    vec2 uv;
    vec3 dpdu;
    vec3 dpdv;
#endif
#if BUMP_FULL
    vec3 dndu;
    vec3 dndv;
#endif
};

SurfacePoint surface_point(vec3 p_object, vec3 dir_object) {
    SurfacePoint s;
    s.p_object = p_object;
#if SHAPE == MESH
    // Between vertices whose normals are opposite there is none: 0, and no NaN.
    s.n_object = mesh_normal * inversesqrt(max(dot(mesh_normal, mesh_normal), 1e-30));
#if HAS_UV
    s.uv = mesh_uv / one;
    s.dpdu = mesh_dpdu / one;
    s.dpdv = mesh_dpdv / one;
#if BUMP_FULL
    s.dndu = mesh_dndu / one;
    s.dndv = mesh_dndv / one;
#endif
#endif
#elif SHAPE == SPHERE
#if TWO_SIDED
    // Seen from within, it is entered from behind.
    if (!gl_FrontFacing) dir_object = -dir_object;
#endif
    vec3 p = p_object + sphere_step(p_object, dir_object, radius) * dir_object;
    s.p_object = p;
    s.n_object = p / radius;
#if HAS_UV
    s.uv = sphere_uv(p);
    s.dpdu = sphere_dpdu(p);
    s.dpdv = sphere_dpdv(p);
#if BUMP_FULL
    s.dndu = sphere_dndu(p, radius);
    s.dndv = sphere_dndv(p, radius);
#endif
#endif
#elif SHAPE == TORUS
    vec3 p = p_object + torus_step(p_object, dir_object, radius, tube) * dir_object;
    s.p_object = p;
    s.n_object = torus_normal(p, radius);
#if HAS_UV
    s.uv = torus_uv(p, radius);
    s.dpdu = torus_dpdu(p);
    s.dpdv = torus_dpdv(p, radius);
#if BUMP_FULL
    s.dndu = torus_dndu(p, radius);
    s.dndv = torus_dndv(p, radius);
#endif
#endif
#elif SHAPE == QUAD
    s.n_object = normalize(cross(corners[2] - corners[0], corners[3] - corners[1]));
#if HAS_UV
    s.uv = inverse_bilinear(p_object, corners[0], corners[1], corners[2], corners[3]);
    s.dpdu = bilinear_dpdu(s.uv, corners[0], corners[1], corners[2], corners[3]);
    s.dpdv = bilinear_dpdv(s.uv, corners[0], corners[1], corners[2], corners[3]);
#endif
#else
#error "SHAPE must be MESH, SPHERE, TORUS or QUAD"
#endif
    return s;
}
