"""Cameras, as the table of a scene that says the same."""

import numpy as np

from . import _firstlight

# What turns the axes of OpenCV's camera, which looks along z with y down, to those of OpenGL's
_OPENGL_FROM_OPENCV = np.diag([1.0, -1.0, -1.0])
# How far a rotation may be from one
_ROUNDING = 1e-4


def _frame(pose, convention):
    """Position, right, up and forward of a camera, from the matrix that takes camera space to the world."""
    pose = np.asarray(pose, dtype=np.float64)
    if pose.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"pose: a matrix of 4 x 4 or 3 x 4 numbers is wanted, this is {pose.shape}")
    if not np.isfinite(pose).all():
        raise ValueError("pose: there are numbers that are not finite")
    if pose.shape == (4, 4) and not np.allclose(pose[3], [0, 0, 0, 1], atol=_ROUNDING):
        raise ValueError(f"pose: the last row is {pose[3]}, not [0 0 0 1]")
    rotation, position = pose[:3, :3], pose[:3, 3]
    if not np.allclose(rotation.T @ rotation, np.eye(3), atol=_ROUNDING) or np.linalg.det(rotation) < 0:
        raise ValueError("pose: its first three columns are no rotation; is it camera to world, without a scale?")
    if convention == "opencv":
        rotation = rotation @ _OPENGL_FROM_OPENCV
    elif convention != "opengl":
        near = _firstlight._nearest(str(convention), ["opencv", "opengl"])
        hint = f"; did you mean {near!r}?" if near else ""
        wanted = "'opencv' (y down, z forward) or 'opengl' (y up, z back)"
        raise ValueError(f"convention is {convention!r}; it is {wanted}{hint}")
    return position, rotation[:, 0], rotation[:, 1], -rotation[:, 2]


def _placed(pose, convention):
    """The fields that put a camera there."""
    position, _, up, forward = _frame(pose, convention)
    # As far away as the place is from 0, so that nothing is lost in the sum
    ahead = position + forward * max(1.0, float(np.abs(position).max()))
    return {"position": position.tolist(), "look_at": ahead.tolist(), "up": up.tolist()}


class Camera:
    """A camera: any of the fields of `[camera]` in a scene, and the size of its picture.

    Parameters
    ----------
    position, look_at, up : three numbers
        Where the eye is and what it looks at, in metres, world space; the direction that is up in the picture.
    width, height : int, optional
        The columns and rows of its picture, for `render` calls that say none.
    **fields
        All else that a camera of a scene takes: `fov_y_deg`, `focal_length_mm`, `focal_length_px`,
        `principal_point_px`, `projection`, `shift`, `transform`, ...
    """

    def __init__(self, *, position, width=None, height=None, **fields):
        self.fields = {"position": position, **fields}
        self.width = width
        self.height = height

    @classmethod
    def from_pose(cls, pose, *, convention="opencv", fov_y_deg=None, K=None, width=None, height=None, pixel_center=0.5):
        """A camera from the matrix that takes its space to the world.

        Parameters
        ----------
        pose : array of shape (4, 4) or (3, 4)
            Camera to world, a rotation and a place in metres.
        convention : {"opencv", "opengl"}
            Whether the camera looks along z with y down, or along -z with y up.
        fov_y_deg : float, optional
            The vertical field of view, in degrees; instead of K. With neither it is 45.
        K : array of shape (3, 3), optional
            The camera matrix, in pixels of a picture of `width` x `height`.
        pixel_center : {0.5, 0}
            Where K has the middle of the first pixel: 0 is OpenCV's.
        """
        if K is not None:
            if fov_y_deg is not None:
                raise ValueError("fov_y_deg and K say the same twice; keep one of them")
            return cls.from_K(
                K, width=width, height=height, pixel_center=pixel_center, pose=pose, convention=convention
            )
        return cls(width=width, height=height, fov_y_deg=fov_y_deg, **_placed(pose, convention))

    @classmethod
    def from_K(
        cls,
        K=None,
        *,
        fx=None,
        fy=None,
        cx=None,
        cy=None,
        width,
        height,
        pixel_center=0.5,
        pose=None,
        convention="opencv",
    ):
        """A camera from its matrix, in pixels, exactly: fx and fy may differ, cx and cy lie anywhere.

        Parameters
        ----------
        K : array of shape (3, 3), optional
            [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]; or the four numbers by themselves.
        width, height : int
            The columns and rows of the picture that K is of.
        pixel_center : {0.5, 0}
            Where K has the middle of the first pixel: at (0.5, 0.5), or at (0, 0) as OpenCV's functions have it.
        pose : array of shape (4, 4) or (3, 4), optional
            Camera to world; without it the camera is at 0 and looks along z with y down ("opencv") or along -z.
        convention : {"opencv", "opengl"}
            The axes of the camera's space in `pose`.
        """
        if K is not None:
            if any(number is not None for number in (fx, fy, cx, cy)):
                raise ValueError("K and fx, fy, cx, cy say the same twice; keep one of them")
            K = np.asarray(K, dtype=np.float64)
            if K.shape != (3, 3):
                raise ValueError(f"K: a matrix of 3 x 3 numbers is wanted, this is {K.shape}")
            zeros = (K[0, 1], K[1, 0], K[2, 0], K[2, 1])
            if any(number != 0 for number in zeros) or K[2, 2] != 1:
                raise ValueError("K: its skew is not 0, or its last row is not [0 0 1]; such cameras are not rendered")
            fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
        missing = [name for name, number in zip(("fx", "fy", "cx", "cy"), (fx, fy, cx, cy)) if number is None]
        if missing:
            raise ValueError(f"{', '.join(missing)}: K or all of fx, fy, cx and cy are wanted")
        if pixel_center not in (0, 0.5):
            raise ValueError(f"pixel_center is {pixel_center}; the middle of the first pixel is at 0.5 or at 0")
        moved = 0.5 - pixel_center
        return cls(
            width=width,
            height=height,
            focal_length_px=[float(fx), float(fy)],
            principal_point_px=[float(cx) + moved, float(cy) + moved],
            **_placed(np.eye(4) if pose is None else pose, convention),
        )

    def resized(self, width, height):
        """The same camera with a picture of another size: what is said in pixels is scaled with it."""
        fields = dict(self.fields)
        if "focal_length_px" in fields:
            if self.width is None or self.height is None:
                raise ValueError("the camera's own width and height are not known")
            scale = (width / self.width, height / self.height)
            for key in ("focal_length_px", "principal_point_px"):
                if fields.get(key) is not None:
                    fields[key] = [number * by for number, by in zip(fields[key], scale)]
        return Camera(width=width, height=height, **fields)

    def _sized(self):
        """The table and the size of its picture, which has to be known."""
        if self.width is None or self.height is None:
            raise ValueError("the size of its picture is not known: give the camera a width and a height")
        return self.to_dict(), self.width, self.height

    @property
    def K(self):
        """The camera matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]: (3, 3), float64, in pixels of its picture.

        x is to the right, y down, and the middle of the first pixel at (0.5, 0.5).

        Raises
        ------
        ValueError
            The camera has no width and height, or is orthographic.
        """
        return _firstlight._camera_k(*self._sized())

    def pose(self, convention="opencv"):
        """The matrix from camera to world: (4, 4), float64, metres. What `from_pose` takes.

        Parameters
        ----------
        convention : {"opencv", "opengl"}
            Whether the camera looks along z with y down, or along -z with y up.
        """
        return _firstlight._camera_pose(self.to_dict(), self.width or 1024, self.height or 1024, convention)

    def project(self, points):
        """Where points are in the picture, also outside of it and behind other things.

        Parameters
        ----------
        points : array of shape (..., 3)
            In metres, world space.

        Returns
        -------
        array of shape (..., 2), float64
            x and y in pixels from the upper left corner, so that (0.5, 0.5) is the middle of the first pixel; NaN for
            what is behind the camera.

        Raises
        ------
        ValueError
            The camera has no width and height.
        """
        points = np.asarray(points, dtype=np.float64)
        if points.shape[-1:] != (3,):
            raise ValueError(f"points: an array of shape {points.shape}; (..., 3) is wanted")
        return _firstlight._camera_project(*self._sized(), points.reshape(-1, 3)).reshape(*points.shape[:-1], 2)

    def to_dict(self):
        """The table of the scene format that says the same."""
        return {key: value for key, value in self.fields.items() if value is not None}

    def _resolve(self, width, height):
        """The table, and the size of the picture, for a render that asks for a size."""
        asked = (width, height)
        size = (self.width, self.height) if asked == (None, None) else asked
        if "focal_length_px" in self.fields and None not in (self.width, self.height):
            if size != (self.width, self.height):
                own = f"{self.width} x {self.height}"
                raise ValueError(
                    f"the camera's matrix is of a picture of {own}, and {width} x {height} is asked for; "
                    "camera.resized(width, height) scales it"
                )
        return self.to_dict(), *size

    def __repr__(self):
        fields = {**self.to_dict(), "width": self.width, "height": self.height}
        return f"Camera({', '.join(f'{key}={value!r}' for key, value in fields.items() if value is not None)})"
