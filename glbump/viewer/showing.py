"""What is shown, and how that changes: one scene, one quality and a few values. No window, no OpenGL."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from glbump.camera import Camera
from glbump.contents import Contents
from glbump.errors import GlbumpError
from glbump.gl.source import SUFFIXES, find_shaders
from glbump.quality import Quality, quality_of
from glbump.scene import Scene, with_value
from glbump.scenefile import files_of, load_scene
from glbump.shapes import Shape
from glbump.shown import SHOWN
from glbump.viewer import navigation, opening
from glbump.viewer.opening import Subject
from glbump.viewer.watch import Watch

Open = Callable[[Contents], Subject]

STAY = 6.0
"""Seconds that a note is shown."""


class Showing:
    """The state of a window.

    opens: what there is to show, each made when it is its turn. tone, exposure: in place of the subjects' own.
    version: goes up when the picture has to be drawn anew; changed: when it last did, or the tone or exposure.
    exposed: how often what there is has still to be brought to the screen. note: what was done, for a while; work: what
    is being done; told: of a pixel, until the picture changes. view: what is shown in place of light, a name of
    glbump.shown.
    """

    def __init__(
        self,
        opens: Sequence[Open],
        quality: str | Quality = "balanced",
        *,
        tone: str | None = None,
        exposure: float | None = None,
    ) -> None:
        self._opens, self._number = tuple(opens), 0
        self._wanted = tone, exposure
        self.contents = Contents()
        self.quality = quality_of(quality)
        self.subject = Subject("", Scene([]))
        self.scene, self.tone, self.exposure = self.subject.scene, self.subject.tone, self.subject.exposure
        self.version, self.changed, self.exposed = 0, 0.0, 1
        self._troubles: dict[str, str] = {}
        self.note, self.work, self.told = "", "", ""
        self.view: str | None = None
        self.shows_help = False
        self._note_until = 0.0
        self._jobs: list[Iterator[str]] = []
        self._shaders = [path for path in find_shaders().rglob("*") if path.suffix in (*SUFFIXES, ".glsl")]
        self._watch = Watch()

    def touch(self) -> None:
        """The picture has to be drawn anew."""
        self.version += 1
        self.changed = time.perf_counter()
        self.told = ""

    def expose(self, times: int = 1) -> None:
        """The picture has to be brought to the screen again, with what lies over it."""
        self.exposed = max(self.exposed, times)

    # ------------------------------------------------------------ scene, camera, quality

    def show(self, scene: Scene) -> None:
        """Another scene, or another state of it."""
        if scene is not self.scene:
            self.scene = scene
            file = [self.subject.file] if self.subject.file else []
            self._watch.follow([*file, *files_of(scene), *self._shaders])
            self.touch()

    def put(self, dotted: str, value: Any) -> None:
        """One value of the scene, named as in a scene file: "surface.0.bump.amplitude". SceneError for a wrong one."""
        self.show(with_value(self.scene, dotted, value))

    def show_subject(self, subject: Subject) -> None:
        """Something else altogether; what is wrong with the file or a value of the subject before goes with it."""
        self.forgive("scene file")
        self.forgive("value")
        tone, exposure = self._wanted
        self.subject = subject
        self.tone, self.exposure = tone or subject.tone, subject.exposure if exposure is None else exposure
        self.show(subject.scene)

    def move(self, movement: Callable[[Camera], Camera]) -> None:
        """Another camera."""
        camera = movement(self.scene.camera)
        if camera != self.scene.camera:
            self.scene = replace(self.scene, camera=camera)
            self.touch()

    def fit(self, size: tuple[int, int]) -> None:
        """All surfaces in the picture of a window of `size`."""
        box = opening.bounds(self.scene, self.contents)
        if box is not None:
            self.move(lambda camera: navigation.fitted(camera, box, size[0] / size[1]))

    def reset_camera(self) -> None:
        """The camera as the subject has it."""
        self.move(lambda _: self.subject.scene.camera)

    def turn_environment(self, degrees: float) -> None:
        """The environment turned about +Y, counter-clockwise seen from above."""
        environment = self.scene.environment
        turned = replace(environment, rotation=(environment.rotation + degrees) % 360)
        self.scene = replace(self.scene, environment=turned)
        self.touch()

    def set_quality(self, quality: str | Quality) -> None:
        """Another quality: a preset's name, or knobs of one's own."""
        self.quality = quality_of(quality)
        self.touch()

    def show_view(self, steps: int) -> None:
        """The next of light and of what glbump.shown names, or the one before."""
        views = (None, *SHOWN)
        self.view = views[(views.index(self.view) + steps) % len(views)]
        self.touch()
        self.say("light" if self.view is None else f"{self.view}: {SHOWN[self.view].colours}")

    def show_as(self, *, tone: str | None = None, exposure: float | None = None) -> None:
        """Another tone curve, or exposure in stops; nothing is drawn anew."""
        self.tone = self.tone if tone is None else tone
        self.exposure = self.exposure if exposure is None else min(max(exposure, -64.0), 64.0)
        self.changed = time.perf_counter()
        self.expose()

    # ------------------------------------------------------------ files

    @property
    def stem(self) -> str:
        """What files that are written are called."""
        return Path(self.subject.name).stem or "glbump"

    def go(self, steps: int) -> None:
        """To a subject after or before this one, round and round."""
        if steps and len(self._opens) == 1:
            self.say("this is all there is; glbump view without a file shows the gallery, and files may be dropped")
            return
        number = (self._number + steps) % len(self._opens)
        self._number = number

        def job() -> Iterator[str]:
            yield "opening ..."
            self.show_subject(self._opens[number](self.contents))

        self.begin(job())

    def drop(self, paths: Sequence[Path], surface: int) -> None:
        """Files dropped on the window: scenes are opened, all others become part of this one, bumps on `surface`; on
        the first where other surfaces have come before their turn does, by a mesh among the files, say."""

        def shapes() -> list[Shape]:
            return [surface.shape for surface in self.scene.surfaces]

        def job() -> Iterator[str]:
            for path in paths:
                yield f"opening {path.name} ..."
                if not self.scene.surfaces or opening.kind_of(path)[0] == opening.SCENE:
                    self.show_subject(opening.opened(path, self.contents))
                else:
                    place = surface if shapes() == pointed else 0
                    self.show(opening.dropped(path, self.scene, place, self.contents))

        pointed = shapes()
        self.begin(job())

    def look_at_files(self) -> bool:
        """Take up what has changed on disk; whether shaders have."""
        changed = self._watch.changed()
        if changed:
            self.touch()
        if self.subject.file in changed:
            self.attempt("scene file", self.read_scene)
        return any(path.suffix in (*SUFFIXES, ".glsl") for path in changed)

    def read_scene(self) -> None:
        """The scene's file again. The camera stays where it was taken to, unless the file has moved its own."""
        file, before = self.subject.file, self.subject.scene
        if file is not None:
            scene = load_scene(file)
            self.subject = replace(self.subject, scene=scene)
            camera = self.scene.camera if scene.camera == before.camera else scene.camera
            self.show(replace(scene, camera=camera))
            self.say(f"{file.name} was read again")

    # ------------------------------------------------------------ what is said, and work that takes a while

    def say(self, text: str) -> None:
        """A line in the window, for a while."""
        self.note, self._note_until = text, time.perf_counter() + STAY
        self.expose()

    @property
    def trouble(self) -> str:
        """All that is wrong, a line or some of each."""
        return "\n".join(self._troubles.values())

    def attempt(self, what: str, action: Callable[[], object]) -> bool:
        """Do something, and whether it went well. What goes wrong is said until `what` goes well, or is put away."""
        try:
            action()
        except Exception as error:
            self.complain(what, error)
            return False
        self.forgive(what)
        return True

    def tell(self, text: str) -> None:
        """Rows of two columns, until the picture changes."""
        self.told = text
        self.expose()

    def complain(self, what: str, error: Exception) -> None:
        """Something went wrong."""
        self._troubles[what] = told(error, self._troubles.get(what, ""))
        self.expose()

    def forgive(self, what: str) -> None:
        """What went wrong with `what` has gone well, or is no longer of interest."""
        if self._troubles.pop(what, None) is not None:
            self.expose()

    def fade(self, now: float) -> None:
        """Put a note away whose time is over."""
        if self.note and now > self._note_until:
            self.note = ""
            self.expose()

    def toggle_help(self) -> None:
        """The table of keys, on and off."""
        self.shows_help = not self.shows_help
        self.expose()

    @property
    def is_busy(self) -> bool:
        """Whether there is work to go on with."""
        return bool(self._jobs)

    def begin(self, job: Iterator[str]) -> None:
        """Work to be done piece by piece; it says beforehand what each piece is."""
        self._jobs.append(job)
        if len(self._jobs) == 1:
            self.go_on()

    def go_on(self) -> None:
        """One more piece."""
        self.expose()
        self.work = ""
        while self._jobs and not self.work:
            try:
                self.work = next(self._jobs[0])
            except StopIteration:
                self._jobs.pop(0)
            except Exception:
                self._jobs.pop(0)
                raise

    def stop(self) -> None:
        """Give up what goes on, and put all plates away."""
        stopped = self._jobs
        self._jobs, self.work, self.note, self.told, self.shows_help = [], "", "", "", False
        self._troubles.clear()
        if stopped:
            self.say("stopped")
        self.expose()


def told(error: Exception, before: str = "") -> str:
    """What went wrong, for the window: the first lines of glbump's own errors; of others what to do. Where a defect
    came from is written to stderr, unless `before`, what was said last, is the same."""
    if isinstance(error, GlbumpError):
        return "\n".join(str(error).splitlines()[:8])
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return "out of memory; make the window smaller, or choose another quality"
    says = f"a defect of glbump, please report it with what the terminal shows: {type(error).__name__}: {error}"
    if says != before:
        traceback.print_exception(error)
    return says
