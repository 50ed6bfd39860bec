"""Conventions, stated once. tests/geometry holds a test of each.

Space   millimetres, right-handed, +x the subject's left, +y up, +z out of the face; the origin lies
        midway between the eyeball centres of the mean head.
Camera  camera space has the same handedness; the camera sits at its origin and looks along -z, so a
        visible point has negative z. With p = R x + t:  u = cx - f px / pz,  v = cy + f py / pz.
Pixels  the centre of the top left pixel is (0.5, 0.5); rows run down.
UV      (0, 0) is the top left corner of the atlas, rows run down (glTF); texel centres at +0.5.
Colour  photos are sRGB-encoded, light and textures are scene-linear Rec.709.
Light   irradiance at unit normal n is sum_k L_k Y_k(n), real spherical harmonics up to order 2,
        normals in camera space.
"""
