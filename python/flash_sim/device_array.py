"""Numbers that live on a CUDA device."""
import numpy as np

from flash_sim import _core

CUDA_KINDS = (2, 13)  # of memory, by DLPack: of a device, and managed
PROCESSOR = (1, 0)
DEFAULT_STREAM = 1    # by DLPack: the legacy default stream of CUDA


class DeviceArray:
    """A live, read-only view on the memory of a CUDA device: it shows the end of the last step.

    torch, jax, cupy and warp take it without a copy by DLPack (`torch.from_dlpack(x)`), others by `__cuda_array_interface__`.
    `x.numpy()` is a copy in the memory of the processor. After another initialize(), and after close(), each of these raises
    RuntimeError; arrays that others made of it before keep the last numbers.

    All steps have ended when step() returns, so what a stream reads afterwards is complete: it has to wait for nothing, also
    while a graph is captured. Views change after what has been queued on the default stream. Who reads them on a stream that
    does not wait for that one synchronizes it before the next call that changes the state.
    """

    def __init__(self, take, copy):
        """take(): the array of the extension as it is now. copy(): the numbers as an array of numpy."""
        self._take, self._copy = take, copy
        self._read = None  # what others read by its address
        array = take()
        self.shape = _core.placed(array)[1]
        self.device = f"cuda:{array.__dlpack_device__()[1]}"

    dtype = np.dtype(np.float64)

    @property
    def ndim(self):
        return len(self.shape)

    def numpy(self) -> np.ndarray:
        """A copy in the memory of the processor."""
        return self._copy()

    def __len__(self):
        return self.shape[0]

    def __repr__(self):
        return f"<flash_sim.DeviceArray of {self.shape} float64 on {self.device}>"

    def __array__(self, *_, **__):
        raise TypeError(f"found an array on {self.device}, expected one of numpy: take x.numpy(), a copy")

    def __dlpack_device__(self):
        return self._take().__dlpack_device__()

    def __dlpack__(self, *, stream=None, max_version=None, dl_device=None, copy=None):
        if stream is not None and (isinstance(stream, bool) or not isinstance(stream, int) or stream < -1 or stream == 0):
            raise ValueError(f"__dlpack__: stream: found {stream!r:.60}, expected None, -1, or the number of a CUDA stream")
        if dl_device is not None and tuple(dl_device) == PROCESSOR:
            return self.numpy().__dlpack__(max_version=max_version)
        return self._take().__dlpack__(max_version=max_version, dl_device=dl_device, copy=copy)

    @property
    def __cuda_array_interface__(self):
        self._read = self._take()  # whoever reads it keeps this, and so the memory
        address, shape, strides = _core.placed(self._read)
        return {"version": 3, "typestr": "<f8", "shape": shape, "strides": strides, "data": (address, True), "stream": None}


class DeviceStatus(DeviceArray):
    """(n_envs, 7) numbers of each environment. status["lost"] is a DeviceArray of one of them, (n_envs,); numpy() is an array
    of (n_envs,) with names, as that of the processor."""

    def __init__(self, take, copy, names):
        """take(column) and copy(column): of one number, or None for all."""
        super().__init__(lambda: take(None), lambda: copy(None))
        self._of = lambda column: DeviceArray(lambda: take(column), lambda: copy(column))
        self._names = names

    def __getitem__(self, name):
        if name not in self._names:
            raise KeyError(f"status: found {name!r:.60}, expected one of {', '.join(self._names)}")
        return self._of(self._names.index(name))


def to_host(array) -> np.ndarray:
    """A copy as an array of numpy, of a view of RealtimeSim on any device, or of any array that DLPack or numpy knows."""
    if isinstance(array, DeviceArray):
        return array.numpy()
    return np.array(on_host(array))


def on_host(value):
    """`value`, or a copy in the memory of the processor where it is on a CUDA device."""
    if isinstance(value, np.ndarray) or not hasattr(value, "__dlpack_device__"):
        return value
    if value.__dlpack_device__()[0] not in CUDA_KINDS:
        return value
    return _core.to_host(value.__dlpack__(stream=DEFAULT_STREAM))
