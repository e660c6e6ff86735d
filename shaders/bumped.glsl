// The normal of a surface as its bumps bend it, by everything that bump_input.glsl adds up. Glue for lib/bump.glsl and
// lib/spread.glsl.

#include "bump_input.glsl"
#include "footprint_input.glsl"

Varied bent(Varied n, vec3 gradient) {
    Varied result = Varied(bump_normal(n.at, gradient), vec3(0.0), vec3(0.0));
#if FOOTPRINT
    // There is no slope of a map's slopes but from pixel to pixel.
    result.dx = bump_normal_change(n.at, gradient, n.dx, dFdx(gradient));
    result.dy = bump_normal_change(n.at, gradient, n.dy, dFdy(gradient));
#endif
    return result;
}

#if HAS_WORLD
// Of the height's slopes by u and v.
vec3 gradient_by_uv(vec3 n_env, vec3 dpdu, vec3 dpdv, vec2 slope) {
#if (SHAPE == SPHERE || SHAPE == TORUS) && TRANSFORM != GENERAL
    return orthogonal_gradient(dpdu, dpdv, slope);
#else
    return surface_gradient(n_env, dpdu, dpdv, slope);
#endif
}
#endif

// The bent normal; and round it the spread of normals that are not seen one by one, in slopes against it. With FLATS this is
// of a share of them, and the others, about the normal that is not bent, have the spread flat_around.
Varied bumped(SurfacePoint s, Varied p_met, Varied n, out Varied around, out float share, out Varied flat_around) {
    vec3 n_env = n.at;
    Place at;
#if HAS_UV
    at.uv = s.uv;
    at.uv_dx = at.uv_dy = vec2(0.0);
#if BUMP_MIP && SHAPE == MESH
    at.uv_dx = dFdx(s.uv);
    at.uv_dy = dFdy(s.uv);
#elif BUMP_MIP
    at.uv_dx = uv_change(p_met.dx, s.dpdu, s.dpdv);
    at.uv_dy = uv_change(p_met.dy, s.dpdu, s.dpdv);
#endif
    vec3 dpdu = turned(s.dpdu);
    vec3 dpdv = turned(s.dpdv);
#endif
#if HAS_TRIPLANAR
    at.p = s.p_object;
    at.n = s.n_object;
    at.p_dx = p_met.dx;
    at.p_dy = p_met.dy;
#if TRANSFORM == GENERAL
    mat3 gradient_matrix = env_from_object_gradient;
#elif TRANSFORM == ORTHOGONAL
    mat3 gradient_matrix = env_from_object;
#else
    const mat3 gradient_matrix = mat3(1.0);
#endif
#endif
#if SPREAD
    // Of gradients, along two axes of the tangent plane.
    vec3 x, y;
    mat2x3 moments = mat2x3(0.0);
    axes_across(n_env, x, y);
#if HAS_TRIPLANAR
    at.x = x * gradient_matrix;
    at.y = y * gradient_matrix;
#endif
#endif
    Relief relief = relief_at(at);
    vec3 gradient = vec3(0.0);
#if HAS_NORMALS
    vec3 t, b;
    tangent_frame(n_env, dpdu, dpdv, t, b);
    gradient += relief.by_tangent.x * t + relief.by_tangent.y * b;
#if SPREAD
    moments += spread_across(x, y, t, b, relief.spread_by_tangent);
#endif
#endif
#if HAS_PARAMETER
    gradient += invariant_gradient(n_env, dpdu, dpdv, relief.by_parameter);
#if SPREAD
    // By the lengths of slopes along u and v alone, which is right to their sum.
    moments += spread_across(x, y, invariant_gradient(n_env, dpdu, dpdv, vec2(1.0, 0.0)),
                             invariant_gradient(n_env, dpdu, dpdv, vec2(0.0, 1.0)), relief.spread_by_parameter);
#endif
#endif
#if HAS_WORLD
#if BUMP_FULL
    dpdu += relief.height * turned_change(s.dndu, s.n_object);
    dpdv += relief.height * turned_change(s.dndv, s.n_object);
#endif
    gradient += gradient_by_uv(n_env, dpdu, dpdv, relief.by_uv);
#if SPREAD
    moments += spread_across(x, y, gradient_by_uv(n_env, dpdu, dpdv, vec2(1.0, 0.0)),
                             gradient_by_uv(n_env, dpdu, dpdv, vec2(0.0, 1.0)), relief.spread_by_uv);
#endif
#endif
#if HAS_TRIPLANAR
    gradient += volume_gradient(n_env, gradient_matrix * relief.by_object);
#if SPREAD
    moments += relief.spread_by_object;
#endif
#endif
#if HAS_SCREEN
    gradient += surface_gradient_screen(n_env, turned(s.p_object), relief.on_screen);
#endif
#if SHOW == SHOW_SLOPE
    shown = vec4(world_from_env * gradient, 1.0);
#endif
    share = 1.0;
    flat_around = Varied(n_env, vec3(0.0), vec3(0.0));  // its middle is not read
#if FLATS
    vec2 steep;
    steep_part(1.0 - relief.flats, vec2(dot(gradient, x), dot(gradient, y)), moments[0], share, steep, moments[0]);
    gradient = steep.x * x + steep.y * y;
    spread_along(x, y, moments[1], flat_around.dx, flat_around.dy);
#endif
    Varied result = bent(n, gradient);
    around = Varied(result.at, vec3(0.0), vec3(0.0));
#if SPREAD
    spread_along(x, y, moments[0], x, y);
    around.dx = bump_normal_change(n_env, gradient, vec3(0.0), x);
    around.dy = bump_normal_change(n_env, gradient, vec3(0.0), y);
#endif
    return result;
}
