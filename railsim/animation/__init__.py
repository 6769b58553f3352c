"""Animation: a run or a mode as a page that plays, a GIF or a film.

==============  ============================================================================
`scene.py`      a result, or a mode of ``railsim modes``, as bodies, poses, track, forces, wheels
`page.py`       a scene as one self-contained HTML page (``page.html``, ``.css``, ``.js``)
`movie.py`      a scene as GIF or MP4
==============  ============================================================================

Begin reading in `scene.py`.
"""

from pathlib import Path

from railsim.animation.movie import ENDINGS as FILMS
from railsim.animation.movie import write_movie
from railsim.animation.page import ENDINGS as PAGES
from railsim.animation.page import write_page
from railsim.animation.scene import FILM_FRAMES, FRAMES, Scene, mode_scene, result_scene
from railsim.errors import argument_error
from railsim.files.access import check_file
from railsim.result import Result

__all__ = ["Scene", "animate", "mode_scene", "result_scene", "write_movie", "write_page"]


def animate(
    shown: Result | Scene,
    path: str | Path,
    *,
    frames_per_second: int = 20,
    gain: float = 1.0,
    overwrite: bool = False,
) -> Path:
    """Write a run or a mode as a page that plays in a browser, or as a film.

    Parameters
    ----------
    shown : railsim.Result or railsim.animation.Scene
        Run, or scene of a part of one (`railsim.animation.result_scene`) or of a mode
        (`railsim.animation.mode_scene`).
    path : str or path
        ``.html``, ``.gif`` or ``.mp4``, which needs ffmpeg.
    frames_per_second : int
        Of a film [1/s].
    gain : float
        Of a film: magnification of the motion of the bodies [1].
    overwrite : bool
        Replace a file that exists.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    railsim.InputError
        The result lacks something; the name or the location; MP4 without ffmpeg.
    """
    check_file(Path(path), overwrite=overwrite, endings=(*PAGES, *FILMS))
    if frames_per_second < 1:
        raise argument_error("frames_per_second", f"found {frames_per_second}", "1 or more")
    film = Path(path).suffix.lower() in FILMS
    if not isinstance(shown, Scene):
        shown = result_scene(shown, frames=FILM_FRAMES if film else FRAMES)
    if not film:
        return write_page(shown, path, overwrite=overwrite)
    rate = frames_per_second
    return write_movie(shown, path, frames_per_second=rate, gain=gain, overwrite=overwrite)
