#!/usr/bin/env python3
"""Writes the OBJ files in scenes/meshes, which the scenes of this folder name.

Python's standard library is all it needs. The files are kept in the repository, so that nobody has to run this
in order to draw a scene; run it after changing it:  python3 scenes/make_meshes.py
"""
import math
import os
import random

HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "meshes")


class Mesh:
    """Points, faces and tags of one OBJ file."""

    def __init__(self):
        self.points, self.faces, self.creases, self.corners, self.holes, self.tags = [], [], {}, {}, [], []

    def point(self, x, y, z):
        self.points.append((x, y, z))
        return len(self.points) - 1

    def face(self, *corners):
        self.faces.append(list(corners))
        return len(self.faces) - 1

    def crease(self, a, b, sharpness):
        self.creases[(min(a, b), max(a, b))] = sharpness

    def crease_loop(self, loop, sharpness, closed=True):
        for k in range(len(loop) if closed else len(loop) - 1):
            self.crease(loop[k], loop[(k + 1) % len(loop)], sharpness)

    def add(self, other, scale=1.0, turn=0.0, move=(0, 0, 0)):
        """Puts another mesh beside this one: scaled, turned about y (degrees), moved."""
        first, c, s = len(self.points), math.cos(math.radians(turn)), math.sin(math.radians(turn))
        first_face = len(self.faces)
        for x, y, z in other.points:
            x, y, z = scale * x, scale * y, scale * z
            self.point(c * x + s * z + move[0], y + move[1], -s * x + c * z + move[2])
        for f in other.faces:
            self.face(*(v + first for v in f))
        for (a, b), value in other.creases.items():
            self.crease(a + first, b + first, value)
        for v, value in other.corners.items():
            self.corners[v + first] = value
        self.holes += [f + first_face for f in other.holes]
        return self

    def write(self, name, why):
        lines = ["# %s" % why, "# Written by scenes/make_meshes.py."]
        lines += ["v %.6g %.6g %.6g" % p for p in self.points]
        lines += ["f " + " ".join(str(v + 1) for v in f) for f in self.faces]
        lines += ["t crease 2/1/0 %d %d %g" % (a, b, s) for (a, b), s in sorted(self.creases.items())]
        lines += ["t corner 1/1/0 %d %g" % (v, s) for v, s in sorted(self.corners.items())]
        lines += ["t hole 1/0/0 %d" % f for f in self.holes]
        lines += ["t " + t for t in self.tags]
        with open(os.path.join(HERE, name), "w") as out:
            out.write("\n".join(lines) + "\n")


def ring(mesh, n, radius, height, phase=0.0, wave=0.0):
    """n points of a circle about the y axis; wave pushes every second one in and out."""
    loop = []
    for k in range(n):
        a = 2 * math.pi * (k + phase) / n
        r = radius * (1 + (wave if k % 2 else -wave))
        loop.append(mesh.point(r * math.sin(a), height, r * math.cos(a)))
    return loop


def bridge(mesh, lower, upper):
    """Quads between two loops of the same length, outward when the second lies above the first."""
    n = len(lower)
    return [mesh.face(lower[k], lower[(k + 1) % n], upper[(k + 1) % n], upper[k]) for k in range(n)]


def revolve(profile, n, close_bottom=None, close_top=None):
    """A turned body: profile is a list of (radius, height, crease sharpness, wave). Ends are closed by an
    "ngon", by a "fan" of triangles about a pole at the given height, or left open (None)."""
    mesh = Mesh()
    loops = []
    for radius, height, sharpness, wave in profile:
        loop = ring(mesh, n, radius, height, wave=wave)
        if sharpness > 0:
            mesh.crease_loop(loop, sharpness)
        loops.append(loop)
    for a, b in zip(loops, loops[1:]):
        bridge(mesh, a, b)
    for end, loop in ((close_bottom, loops[0][::-1]), (close_top, loops[-1])):
        if end == "ngon":
            mesh.face(*loop)
        elif end is not None:
            pole = mesh.point(0, end, 0)
            for k in range(n):
                mesh.face(loop[k], loop[(k + 1) % n], pole)
    return mesh, loops


def tube(mesh, start, end, way):
    """Joins two quad openings by a square tube: start and end are loops of four points whose corners pair up,
    way the centres and half-sizes between them."""
    last = start
    for centre, across, along, size in way:
        loop = []
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            loop.append(mesh.point(*(centre[k] + size * (a * across[k] + b * along[k]) for k in range(3))))
        bridge(mesh, last, loop)
        last = loop
    bridge(mesh, last, end)


def urn():
    """Fluted body, creased foot and lip, a 16-gon below, a pole of valence 16 inside, two handles."""
    n = 16
    profile = [(0.52, 0.0, 4, 0), (0.55, 0.06, 2.5, 0), (0.42, 0.14, 0, 0), (0.22, 0.26, 0, 0), (0.25, 0.36, 3, 0),
               (0.40, 0.46, 0, 0.07), (0.74, 0.80, 0, 0.08), (0.86, 1.20, 0, 0.08), (0.76, 1.54, 0, 0.07),
               (0.46, 1.78, 2.2, 0), (0.37, 1.94, 0, 0), (0.40, 2.12, 0, 0), (0.62, 2.26, 2, 0),
               (0.63, 2.33, 2.6, 0), (0.52, 2.30, 0, 0), (0.34, 2.12, 0, 0), (0.31, 1.86, 0, 0), (0.62, 1.45, 0, 0),
               (0.62, 0.95, 0, 0), (0.3, 0.62, 0, 0)]
    mesh, loops = revolve(profile, n, close_bottom="ngon", close_top=0.55)
    for k in range(0, n, 2):  # the flutes' valleys
        mesh.crease_loop([loops[j][k] for j in range(5, 10)], 1.4, closed=False)
    for side in (0, n // 2):
        k = side + n // 4
        # The quads of the neck and of the shoulder on this side make room for the handle's ends.
        low, high = (loops[7][k], loops[7][k + 1], loops[8][k + 1], loops[8][k]), (
            loops[10][k], loops[10][k + 1], loops[11][k + 1], loops[11][k])
        mesh.faces = [f for f in mesh.faces if set(f) != set(low) and set(f) != set(high)]
        a = 2 * math.pi * (k + 0.5) / n
        out, across = (math.sin(a), 0, math.cos(a)), (math.cos(a), 0, -math.sin(a))
        way = []
        for radius, height, lean in ((1.08, 1.42, 0.45), (1.19, 1.62, 0.0), (1.12, 1.92, -0.4), (0.86, 2.08, -1.2),
                                     (0.6, 2.06, -1.6)):
            # `along` turns from up at the shoulder to down at the neck.
            turned = math.pi / 2 - lean
            along = (-out[0] * math.sin(turned), math.cos(turned), -out[2] * math.sin(turned))
            way.append(([radius * out[0], height, radius * out[2]], across, along, 0.085))
        # Seen from the way's end the neck's quad is mirrored: top and bottom change places.
        tube(mesh, list(low), [high[3], high[2], high[1], high[0]], way)
    return mesh


def gear(teeth=14):
    """A toothed plate of n-gons: the boss on it is closed by one face of 4 * teeth corners."""
    mesh = Mesh()
    n = 4 * teeth

    def contour(height, swell):
        loop = []
        for k in range(n):
            tooth, place = divmod(k, 4)
            a = 2 * math.pi * (tooth + (0.02, 0.33, 0.52, 0.83)[place]) / teeth
            r = 1.2 if place in (0, 1) else 0.98
            r *= swell
            loop.append(mesh.point(r * math.sin(a), height, r * math.cos(a)))
        return loop

    bottom, top = contour(0.0, 1.0), contour(0.3, 1.0)
    mesh.face(*bottom[::-1])
    bridge(mesh, bottom, top)
    mesh.crease_loop(bottom, 3.5)
    mesh.crease_loop(top, 3.5)
    for a, b in zip(bottom, top):
        mesh.crease(a, b, 2.5)
    last = top
    for radius, height, sharpness in ((0.84, 0.3, 3.5), (0.8, 0.22, 0), (0.56, 0.22, 3), (0.52, 0.4, 3)):
        loop = ring(mesh, n, radius, height)
        # Turn the circle so that its points follow the contour's.
        for k, p in enumerate(loop):
            tooth, place = divmod(k, 4)
            a = 2 * math.pi * (tooth + (0.05, 0.32, 0.55, 0.82)[place]) / teeth
            mesh.points[p] = (radius * math.sin(a), height, radius * math.cos(a))
        bridge(mesh, last, loop)
        if sharpness:
            mesh.crease_loop(loop, sharpness)
        last = loop
    mesh.face(*last)
    return mesh


def icosahedron():
    g = (1 + math.sqrt(5)) / 2
    points = []
    for a in (-1, 1):
        for b in (-g, g):
            points += [(0, a, b), (a, b, 0), (b, 0, a)]
    near = [[j for j in range(12) if j != i and abs(math.dist(points[i], points[j]) - 2) < 1e-9] for i in range(12)]
    return points, near


def lantern():
    """A truncated icosahedron as a thick frame: hexagons are windows, pentagons stay closed."""
    corners, near = icosahedron()
    mesh = Mesh()
    names = {}
    for i in range(12):
        for j in near[i]:
            p = [(2 * corners[i][k] + corners[j][k]) / 3 for k in range(3)]
            length = math.hypot(*p)
            names[(i, j)] = [c / length for c in p]

    def turning(points):
        """The order of points around their own middle, seen from outside."""
        middle = [sum(names[p][k] for p in points) / len(points) for k in range(3)]
        axis = [c / math.hypot(*middle) for c in middle]
        first = [names[points[0]][k] - middle[k] for k in range(3)]
        other = [axis[1] * first[2] - axis[2] * first[1], axis[2] * first[0] - axis[0] * first[2],
                 axis[0] * first[1] - axis[1] * first[0]]

        def angle(p):
            d = [names[p][k] - middle[k] for k in range(3)]
            return math.atan2(sum(map(lambda a, b: a * b, d, other)), sum(map(lambda a, b: a * b, d, first)))

        return sorted(points, key=angle), middle

    outer = {p: mesh.point(*names[p]) for p in names}
    inner = {p: mesh.point(*(0.8 * c for c in names[p])) for p in names}
    faces = [[(i, j) for j in near[i]] for i in range(12)]
    for i in range(12):
        for j in near[i]:
            for k in near[i]:
                if i < j < k and k in near[j]:
                    faces.append([(i, j), (i, k), (j, i), (j, k), (k, i), (k, j)])
    for face in faces:
        loop, middle = turning(face)
        n = len(loop)
        if n == 5:
            mesh.face(*(outer[p] for p in loop))
            mesh.face(*(inner[p] for p in loop[::-1]))
            mesh.crease_loop([outer[p] for p in loop], 1.6)
            continue
        rims = []
        for depth in (1.0, 0.8):
            rim = []
            for p in loop:
                rim.append(mesh.point(*(depth * (0.62 * names[p][k] + 0.38 * middle[k]) for k in range(3))))
            rims.append(rim)
        for k in range(n):
            m = (k + 1) % n
            mesh.face(outer[loop[k]], outer[loop[m]], rims[0][m], rims[0][k])
            mesh.face(rims[0][k], rims[0][m], rims[1][m], rims[1][k])
            mesh.face(rims[1][k], rims[1][m], inner[loop[m]], inner[loop[k]])
        mesh.crease_loop(rims[0], 2.3)
    return mesh


def pawn(n=12):
    """A turned piece: n-gon foot, creased collars, a head that ends in a pole of valence n."""
    profile = [(0.46, 0.0, 5, 0), (0.48, 0.1, 3, 0), (0.36, 0.2, 2, 0), (0.34, 0.26, 0, 0), (0.18, 0.45, 0, 0),
               (0.13, 0.78, 0, 0), (0.15, 0.9, 2, 0), (0.29, 0.94, 4.5, 0), (0.28, 1.0, 3, 0), (0.14, 1.05, 1, 0),
               (0.27, 1.17, 0, 0), (0.31, 1.36, 0, 0), (0.2, 1.56, 0, 0)]
    return revolve(profile, n, close_bottom="ngon", close_top=1.66)[0]


def ribbon(turns=1.6, n=30):
    """An open strip that curls and twists: two boundary curves, four corners, both sides to be seen."""
    mesh = Mesh()
    rows = []
    for k in range(n + 1):
        t = k / n
        a, r = 2 * math.pi * turns * t, 0.95 - 0.6 * t
        lean = 0.25 + 0.9 * math.sin(math.pi * t)
        wide = 0.24 * (0.35 + math.sin(math.pi * min(1, 0.15 + t * 0.85)))
        x, z, y = r * math.sin(a), r * math.cos(a), 0.26 + 0.42 * t
        up, side = math.cos(lean), math.sin(lean)
        rows.append([mesh.point(x * (1 + s * side * wide / r), y + s * up * wide, z * (1 + s * side * wide / r))
                     for s in (-1, 0, 1)])
    for a, b in zip(rows, rows[1:]):
        for k in range(2):
            mesh.face(a[k], b[k], b[k + 1], a[k + 1])
    mesh.crease_loop([r[1] for r in rows], 1.3, closed=False)
    return mesh


def still_life():
    mesh = Mesh()
    mesh.add(urn(), 1.0, 20, (0.95, 0, -0.75))
    mesh.add(gear(), 0.86, 5, (-1.15, 0, 0.05))
    mesh.add(lantern(), 0.72, 12, (-1.15, 1.02, 0.05))
    mesh.add(pawn(), 0.8, 0, (1.72, 0, 0.72))
    mesh.add(ribbon(), 0.75, 200, (0.28, 0, 1.0))
    return mesh


def prism(n, radius=1.0, height=0.9):
    mesh, loops = revolve([(radius, 0, 2, 0), (radius, height, 2, 0)], n, close_bottom="ngon", close_top="ngon")
    return mesh


def prisms():
    """n-gon prisms from triangles to a 40-gon; one of them open at the top."""
    mesh = Mesh()
    for k, n in enumerate((3, 5, 6, 7, 9, 40)):
        mesh.add(prism(n, 0.62, 0.5 + 0.16 * k), 1, 10 * k, (1.45 * (k % 3), 0, 1.5 * (k // 3)))
    return mesh


def staircase(steps=10):
    """Each step's edges are sharper than the last one's: 0, 1, 2 ... 9, by fractions in between."""
    mesh = Mesh()
    left, right = [], []
    outline = []
    for k in range(steps):
        outline.append((k, k * 0.6))
        outline.append((k, (k + 1) * 0.6))
    outline.append((steps, steps * 0.6))
    for x, y in outline:
        left.append(mesh.point(x, y, 0))
        right.append(mesh.point(x, y, 3))
    for k in range(len(outline) - 1):
        mesh.face(left[k], right[k], right[k + 1], left[k + 1])
        if k > 0:
            mesh.crease(left[k], right[k], min(9.0, (k - 1) * 0.475))
    return mesh


def boundaries():
    mesh = Mesh()
    rng = random.Random(5)
    n = 9
    grid = {}
    for x in range(n + 1):
        for z in range(n + 1):
            grid[(x, z)] = mesh.point(x - n / 2 + 0.25 * rng.uniform(-1, 1),
                                      0.5 * math.sin(0.9 * x) * math.cos(0.8 * z) + 0.8, z - n / 2)
    for x in range(n):
        for z in range(n):
            if (x, z) in ((2, 2), (2, 3), (3, 2), (7, 6), (0, 8), (8, 0)):
                continue
            mesh.face(grid[(x, z)], grid[(x, z + 1)], grid[(x + 1, z + 1)], grid[(x + 1, z)])
    used = sorted({v for f in mesh.faces for v in f})
    number = {v: k for k, v in enumerate(used)}
    mesh.points = [mesh.points[v] for v in used]
    mesh.faces = [[number[v] for v in f] for f in mesh.faces]
    return mesh


def darts():
    """A cube of 3x3 faces a side: creases that end (darts), meet in threes (corners), and sharp vertices."""
    mesh = Mesh()
    n = 4
    names = {}

    def at(i, j, k):
        if (i, j, k) not in names:
            names[(i, j, k)] = mesh.point(*(2 * c / n - 1 for c in (i, j, k)))
        return names[(i, j, k)]

    for axis in range(3):
        for side in (0, n):
            for a in range(n):
                for b in range(n):
                    quad = []
                    for da, db in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, a + da, b + db
                        quad.append(at(*p))
                    mesh.face(*(quad if side else quad[::-1]))
    # A crease along three edges of the cube, ending half-way (darts).
    for k in range(2):
        mesh.crease(at(n, n, n - k), at(n, n, n - k - 1), 10)
        mesh.crease(at(n - k, n, n), at(n - k - 1, n, n), 10)
        mesh.crease(at(n, n - k, n), at(n, n - k - 1, n), 10)
    # A semi-sharp crease across the top and one of changing sharpness across the front.
    for k in range(n):
        mesh.crease(at(k, n, 1), at(k + 1, n, 1), 2.7)
        mesh.crease(at(1, k, n), at(1, k + 1, n), 0.6 + 1.1 * k)
    mesh.corners[at(0, n, n)] = 10
    mesh.corners[at(3, n, 3)] = 3.3
    mesh.corners[at(n, 2, 2)] = 10
    for p, up in ((at(3, n, 3), (0, 0.35, 0)), (at(n, 2, 2), (0.35, 0, 0)), (at(2, 2, n), (0, 0, 0.35))):
        mesh.points[p] = tuple(c + d for c, d in zip(mesh.points[p], up))
    return mesh


def main():
    os.makedirs(HERE, exist_ok=True)
    still_life().write("still_life.obj", "Urn, gear, lantern, pawn and ribbon: n-gons, creases, boundaries, high valences.")
    prisms().write("prisms.obj", "Prisms over 3, 5, 6, 7, 9 and 40 corners, creased around their rims.")
    staircase().write("staircase.obj", "A staircase whose edges get sharper from 0 to 8.55 in fractional steps.")
    boundaries().write("boundaries.obj", "An open sheet with holes and corners of valence 2, 3 and 4 on its boundary.")
    darts().write("darts.obj", "A cube with darts, corners, creases of changing sharpness and sharp vertices.")


if __name__ == "__main__":
    main()
