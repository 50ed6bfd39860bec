"""The bytes of a binary glTF file: views and accessors."""

import numpy as np
import pygltflib as gltf

METRES = 0.001  # glTF's unit, from millimetres
STILL = 0.1  # mm; a vertex that a shape moves less is at rest: half a texel of 1024
UNBENT = 0.1  # length; a unit normal that a shape changes less stays as it is: 6 degrees


class Writer:
    """Collects bytes, views and accessors."""

    def __init__(self):
        self.data = bytearray()
        self.views = []
        self.accessors = []
        self.resting = {}  # number of vertices -> accessor of shapes that do nothing to them

    def finish(self):
        """Give all shapes that do nothing one view of zeros.

        glTF takes accessors without a view for zeros; assimp, VTK, Bevy, glTFast and UnityGLTF
        refuse the file.
        """
        if self.resting:
            zeros = self.view(bytes(12 * max(self.resting)), gltf.ARRAY_BUFFER)
            self.views[zeros].byteStride = 12  # which a view of several accessors must state
            for index in self.resting.values():
                self.accessors[index].bufferView, self.accessors[index].byteOffset = zeros, 0

    def view(self, content, target=None):
        """Append bytes, aligned to four; returns the view's index."""
        self.data.extend(bytes(-len(self.data) % 4))
        self.views.append(
            gltf.BufferView(
                buffer=0, byteOffset=len(self.data), byteLength=len(content), target=target
            )
        )
        self.data.extend(content)
        return len(self.views) - 1

    def vectors(self, array, limits=False):
        """Append vectors [N, 2, 3 or 4] of vertices: bytes as they are, others as floats.

        Returns:
            the accessor's index.
        """
        array = np.asarray(array)
        array = np.ascontiguousarray(array, np.uint8 if array.dtype == np.uint8 else np.float32)
        view = self.view(array.tobytes(), gltf.ARRAY_BUFFER)
        self.views[view].byteStride = array.strides[0]  # coarser levels read from it too
        self.accessors.append(
            gltf.Accessor(
                bufferView=view,
                byteOffset=0,
                componentType=gltf.UNSIGNED_BYTE if array.dtype == np.uint8 else gltf.FLOAT,
                count=len(array),
                type=f"VEC{array.shape[1]}",
                **(_limits(array) if limits else {}),
            )
        )
        return len(self.accessors) - 1

    def matrices(self, array):
        """Append matrices [N, 4, 4], transposed as glTF has them; returns the accessor's index."""
        columns = np.ascontiguousarray(array, np.float32).transpose(0, 2, 1)
        self.accessors.append(
            gltf.Accessor(
                bufferView=self.view(columns.tobytes()),
                componentType=gltf.FLOAT,
                count=len(array),
                type="MAT4",
            )
        )
        return len(self.accessors) - 1

    def indices(self, faces):
        """Append triangles; returns the accessor's index."""
        short = faces.max() < 65535
        flat = np.ascontiguousarray(faces, np.uint16 if short else np.uint32).ravel()
        self.accessors.append(
            gltf.Accessor(
                bufferView=self.view(flat.tobytes(), gltf.ELEMENT_ARRAY_BUFFER),
                componentType=gltf.UNSIGNED_SHORT if short else gltf.UNSIGNED_INT,
                count=len(flat),
                type=gltf.SCALAR,
            )
        )
        return len(self.accessors) - 1

    def differences(self, values, least, limits=False):
        """Append what a shape adds to vectors [V, 3]: sparse, or plain where most change.

        Args:
            least: length; shorter differences are none.
            limits: whether to state them, as positions must.

        Returns:
            the accessor's index; all that are zero throughout share one.
        """
        moving = np.flatnonzero(np.linalg.norm(values, axis=1) > least)
        if not len(moving):
            return self._zeros(len(values))
        kept = np.zeros((len(values), 3), np.float32)
        kept[moving] = values[moving]
        wide = len(values) > 65535
        if len(moving) * (16 if wide else 14) > 12 * len(values):
            return self.vectors(kept, limits)
        index = moving.astype(np.uint32 if wide else np.uint16)
        self.accessors.append(
            gltf.Accessor(
                byteOffset=None,  # none without a view
                componentType=gltf.FLOAT,
                count=len(values),
                type=gltf.VEC3,
                **(_limits(kept) if limits else {}),
                sparse=gltf.Sparse(
                    count=len(moving),
                    indices=gltf.AccessorSparseIndices(
                        bufferView=self.view(index.tobytes()),
                        componentType=gltf.UNSIGNED_INT if wide else gltf.UNSIGNED_SHORT,
                    ),
                    values=gltf.AccessorSparseValues(bufferView=self.view(kept[moving].tobytes())),
                ),
            )
        )
        return len(self.accessors) - 1

    def first(self, index, count):
        """An accessor of the first `count` vectors of another one; returns its index."""
        whole = self.accessors[index]
        if whole.count == count:
            return index
        if index in self.resting.values():
            return self._zeros(count)
        values, moving = self._read(whole)
        values, moving = values[:count], moving[moving < count]
        if whole.sparse and not len(moving):
            return self._zeros(count)
        made = gltf.Accessor(
            bufferView=whole.bufferView,
            byteOffset=whole.byteOffset,
            componentType=whole.componentType,
            count=count,
            type=whole.type,
            **(_limits(values) if whole.min else {}),
        )
        if whole.sparse:
            made.sparse = gltf.Sparse(
                count=len(moving), indices=whole.sparse.indices, values=whole.sparse.values
            )
        self.accessors.append(made)
        return len(self.accessors) - 1

    def _zeros(self, count):
        if count not in self.resting:
            self.resting[count] = len(self.accessors)
            zero = [0.0, 0.0, 0.0]
            self.accessors.append(
                gltf.Accessor(
                    componentType=gltf.FLOAT, count=count, type=gltf.VEC3, min=zero, max=zero
                )
            )
        return self.resting[count]

    def _read(self, accessor):
        """The vectors of an accessor, and which of them its sparse values set."""
        width = int(accessor.type[3:])
        if not accessor.sparse:
            kind = np.uint8 if accessor.componentType == gltf.UNSIGNED_BYTE else np.float32
            return self._bytes(accessor.bufferView, kind).reshape(-1, width), np.zeros(0, int)
        wide = accessor.sparse.indices.componentType == gltf.UNSIGNED_INT
        moving = self._bytes(accessor.sparse.indices.bufferView, np.uint32 if wide else np.uint16)
        values = np.zeros((accessor.count, width), np.float32)
        moving = moving[: accessor.sparse.count].astype(int)
        found = self._bytes(accessor.sparse.values.bufferView, np.float32).reshape(-1, width)
        values[moving] = found[: len(moving)]
        return values, moving

    def _bytes(self, view, kind):
        place = self.views[view]
        return np.frombuffer(
            bytes(self.data[place.byteOffset : place.byteOffset + place.byteLength]), kind
        )


def _limits(array):
    return {"min": _short(array.min(0)), "max": _short(array.max(0))}


def _short(values):
    """Numbers with as many digits as tell 32-bit floats apart."""
    return [float(str(value)) for value in values]
