// Directions to places in environments that lie otherwise than lat-long pictures and cubes. Twin:
// glbump/reference/layout.py; the layouts themselves: glbump/maps/projections.py.
// A place is the number of a tile, and s (right), t (down) on it, 0..1. Directions: the environment's frame, any
// length. Layouts of the upper half have what lies below the horizon at the place of its mirror image above.

#include "direction.glsl"

// The sphere as an octahedron, unfolded to a square about +Y (Cigolle et al., JCGT 3(2), 2014).
vec3 octahedral_place(vec3 dir_env) {
    vec3 d = finite_dir(dir_env);
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    vec2 side = vec2(d.x < 0.0 ? -1.0 : 1.0, d.z < 0.0 ? -1.0 : 1.0);
    vec2 q = d.y < 0.0 ? (1.0 - abs(d.zx)) * side : d.xz;
    return vec3(0.0, 0.5 + 0.5 * q);
}

// Upper halves of the sides +X -X +Z -Z of a cube, then its top in two: the half of -Z, that of +Z. Each twice as
// wide as high.
vec3 hemicube_place(vec3 dir_env) {
    vec3 d = turned_up(finite_dir(dir_env));
    float ax = abs(d.x);
    float az = abs(d.z);
    if (d.y > max(ax, az)) {
        bool ahead = d.z < 0.0;
        return vec3(ahead ? 4.0 : 5.0, 0.5 + 0.5 * d.x / d.y, d.z / d.y + (ahead ? 1.0 : 0.0));
    }
    vec3 side = ax >= az ? (d.x < 0.0 ? vec3(1.0, d.z, ax) : vec3(0.0, -d.z, ax))
                         : (d.z < 0.0 ? vec3(3.0, -d.x, az) : vec3(2.0, d.x, az));
    return vec3(side.x, 0.5 + 0.5 * side.y / side.z, 1.0 - d.y / side.z);
}

// Discs of the upper half about +Y, seen from inside, -Z at the top. r = sqrt(2) sin(theta / 2), without sine:
// sin(theta) / sqrt(1 + cos(theta)).
vec3 equal_area_place(vec3 dir_env) {
    vec3 d = turned_up(unit_dir(dir_env));
    return vec3(0.0, 0.5 + vec2(-0.5, 0.5) * d.xz / sqrt(1.0 + d.y));
}

// r = theta / 90 degrees.
vec3 equidistant_place(vec3 dir_env) {
    vec3 d = turned_up(unit_dir(dir_env));
    float across = length(d.xz);
    float right_angles = atan(across, d.y) * 0.63661977236758134308;
    return vec3(0.0, 0.5 + vec2(-0.5, 0.5) * d.xz * (right_angles / max(across, 1e-30)));
}

// r = sin(theta) (Nusselt's disc).
vec3 orthographic_place(vec3 dir_env) {
    vec3 d = unit_dir(dir_env);
    return vec3(0.0, 0.5 + vec2(-0.5, 0.5) * d.xz);
}

// Two discs, up and down: r = tan(theta / 2) about +Y, -Y (Heidrich and Seidel 1998).
vec3 paraboloid_place(vec3 dir_env) {
    vec3 d = unit_dir(dir_env);
    bool down = d.y < 0.0;
    return vec3(down ? 1.0 : 0.0, 0.5 + vec2(down ? 0.5 : -0.5, 0.5) * d.xz / (1.0 + abs(d.y)));
}

// Where a place is, in texels from the upper left, where tiles of `tile` = (width, height) texels stand below each
// other, each with a border of one texel all round.
vec2 tile_texel(vec3 place, vec2 tile) {
    return vec2(1.0 + place.y * tile.x, place.x * (tile.y + 2.0) + 1.0 + place.z * tile.y);
}
