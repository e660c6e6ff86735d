"""The window: `glbump view`. The same renderer as without one; GL stays in glbump.gl."""
