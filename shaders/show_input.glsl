// What is shown in place of light (glbump/shown.py has the same numbers), where SHOW is not 0. Others write to `shown`
// where they come by what is asked for: a: 1 where there is such a value. Nothing of it is there otherwise.

#define SHOW_LEVEL 1
#define SHOW_NORMAL 2
#define SHOW_SLOPE 3
#define SHOW_UV 4
#define SHOW_REFLECTION 5
#define SHOW_FOOTPRINT 6
#define SHOW_COST 7

#if SHOW
uniform mat3 world_from_env;
vec4 shown = vec4(0.0);
#if SHOW == SHOW_FOOTPRINT
#include "lib/footprint.glsl"
#endif
#endif

// Texture reads, of the environment and of bumps.
#if SHOW == SHOW_COST
#define READS(count) shown += vec4(count, 0.0, 0.0, shown.a < 1.0 ? 1.0 : 0.0)
#else
#define READS(count)
#endif
