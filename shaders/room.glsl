// The room that an environment shows: reflections of walls that are near. Glue for lib/parallax.glsl.
// Places are relative to where the environment was taken, in its frame, in units of the room's size (names: _room).

#define BOX 1
#define SPHERICAL 2

#include "lib/parallax.glsl"

#if PARALLAX == BOX
uniform vec3 low_room;
uniform vec3 high_room;
#elif PARALLAX == SPHERICAL
uniform vec3 centre_room;
uniform float radius_room;
#else
#error "PARALLAX must be 0, BOX or SPHERICAL"
#endif

// Direction of what is seen from p_room along dir_env; unit length.
vec3 in_room(vec3 p_room, vec3 dir_env) {
#if PARALLAX == BOX
    return box_parallax(p_room, dir_env, low_room, high_room);
#else
    return sphere_parallax(p_room, dir_env, centre_room, radius_room);
#endif
}
