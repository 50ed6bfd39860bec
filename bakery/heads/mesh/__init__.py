"""A head model out of any mesh of a head that has no shapes of its own.

The built-in head is laid over the mesh; what it knows (shapes, people, landmarks, eyes and teeth) is
carried across.
"""
