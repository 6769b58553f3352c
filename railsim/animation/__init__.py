"""Animation: a run or a mode as a page that plays, a GIF or a film.

==============  ============================================================================
`scene.py`      a result, or a mode of ``railsim modes``, as bodies, poses, track, forces, wheels
`page.py`       a scene as one self-contained HTML page (``page.html``, ``.css``, ``.js``)
`movie.py`      a scene as GIF or MP4
==============  ============================================================================

Begin reading in `scene.py`.
"""

from railsim.animation.movie import write_movie
from railsim.animation.page import write_page
from railsim.animation.scene import Scene, mode_scene, result_scene

__all__ = ["Scene", "mode_scene", "result_scene", "write_movie", "write_page"]
