"""A path tracer for one mesh that knows the positions of doors and windows.

Mitsuba's own path tracer finds a bright court through a door only by chance, and its calls per
surface and shape make it slow on CPUs. Here the whole place is one mesh, surfaces are looked up in
tables, and a vertex indoors sends every second ray through one of the openings. All sampling
techniques are combined by the balance heuristic, so pictures are unbiased up to the depth limit.
"""

from __future__ import annotations

from typing import Any, Final

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.guide import Portals, vec

__all__ = ["LUMINANCE", "Lamp", "Lights", "Surfaces", "first_hit", "radiance"]

Floats = NDArray[np.float64]
Lamp = tuple[Floats, float, Floats]
LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])
_DEPTH: Final = 9
_GUIDED: Final = 0.6  # of the rays from a vertex indoors
_ROULETTE: Final = 3


class Surfaces:
    """Tables of all surfaces.

    Args:
        scene: Contains one mesh.
        normals, colours: (V, 3). By vertex.
        uv: (V, 2). In metres, or 0 to 1 over a fitted picture.
        faces: (M, 3).
        material: (M,). Row of `table`.
        table: (K, 9). First texel, width, height, metres across, metres up, roughness, thinness,
            F0, glow.
        texels: (P,) uint32. Square roots of linear albedo, 8 bits a channel.
        glow: (K, 3). Radiance that a material emits.
    """

    def __init__(self, scene: Any, mesh: dict[str, NDArray[Any]], table: Floats, glow: Floats):
        self.scene = scene
        self.set_normals(mesh["normals"])
        self.uv = mi.Float(mesh["uv"].astype(np.float32).ravel())
        self.colours = mi.Float(mesh["colours"].astype(np.float32).ravel())
        self.faces = mi.UInt32(mesh["faces"].astype(np.uint32).ravel())
        self.material = mi.UInt32(mesh["material"].astype(np.uint32))
        self.corners = mi.Float(mesh["geometric"].astype(np.float32).ravel())
        self.texels = mi.UInt32(mesh["texels"])
        self.first = mi.UInt32(table[:, 0].astype(np.uint32))
        self.wide = mi.Int32(table[:, 1].astype(np.int32))
        self.high = mi.Int32(table[:, 2].astype(np.int32))
        self.table = mi.Float(table[:, 3:9].astype(np.float32).ravel())
        self.glow = mi.Float(glow.astype(np.float32).ravel())

    def set_normals(self, normals: Floats) -> None:
        """Replace the vertex normals, after an object was rotated."""
        self.normals = mi.Float(normals.astype(np.float32).ravel())

    def meet(self, ray: Any, jitter: Any, coherent: Any, active: Any) -> dict[str, Any]:
        """Intersect rays, and return albedo, normals and finish at the hits."""
        pi = self.scene.ray_intersect_preliminary(ray, coherent, active)
        valid = active & pi.is_valid()
        face = dr.select(valid, pi.prim_index, 0)
        index = dr.gather(mi.Vector3u, self.faces, face, valid)
        b1, b2 = pi.prim_uv.x, pi.prim_uv.y
        b0 = 1 - b1 - b2

        def blend(kind: Any, data: Any) -> Any:
            return (
                dr.gather(kind, data, index.x, valid) * b0
                + dr.gather(kind, data, index.y, valid) * b1
                + dr.gather(kind, data, index.z, valid) * b2
            )

        material = dr.gather(mi.UInt32, self.material, face, valid)
        row = [dr.gather(mi.Float, self.table, material * 6 + k, valid) for k in range(5)]
        uv = blend(mi.Point2f, self.uv)
        geometric = dr.gather(mi.Vector3f, self.corners, face, valid)
        shading = dr.normalize(blend(mi.Vector3f, self.normals))
        facing = dr.dot(geometric, ray.d) < 0
        geometric = dr.select(facing, geometric, -geometric)
        shading = dr.select(dr.dot(shading, geometric) < 0, -shading, shading)
        # A shading normal that faces away from the camera would reflect into the surface.
        shading = dr.select(dr.dot(shading, ray.d) < -0.01, shading, geometric)
        return {
            "valid": valid,
            "t": dr.select(valid, pi.t, 0),
            "p": ray.o + ray.d * pi.t,
            "n": shading,
            "g": geometric,
            "albedo": blend(mi.Color3f, self.colours)
            * self._texture(material, uv, row, jitter, valid),
            "rough": row[2],
            "thin": row[3],
            "f0": row[4],
            "glow": dr.select(valid, dr.gather(mi.Color3f, self.glow, material, valid), 0),
            "ball": dr.gather(mi.Float, self.table, material * 6 + 5, valid) > 0,
        }

    def _texture(self, material: Any, uv: Any, row: list[Any], jitter: Any, valid: Any) -> Any:
        wide = dr.gather(mi.Int32, self.wide, material, valid)
        high = dr.gather(mi.Int32, self.high, material, valid)
        u, v = uv.x / row[0], uv.y / row[1]
        u, v = u - dr.floor(u), v - dr.floor(v)
        # A random shift by up to half a texel equals bilinear filtering on average.
        x = mi.Int32(dr.floor(u * mi.Float(wide) + jitter.x - 0.5))
        y = mi.Int32(dr.floor((1 - v) * mi.Float(high) + jitter.y - 0.5))
        x = dr.select(x < 0, x + wide, dr.select(x >= wide, x - wide, x))
        y = dr.select(y < 0, y + high, dr.select(y >= high, y - high, y))
        first = dr.gather(mi.UInt32, self.first, material, valid)
        code = dr.gather(mi.UInt32, self.texels, first + mi.UInt32(y * wide + x), valid)
        roots = [mi.Float((code >> s) & 255) / 255 for s in (0, 8, 16)]
        return mi.Color3f(*[r * r for r in roots])


class Lights:
    """Sun, sky and lamps, and their sampling.

    Args:
        picture: (H, W, 3). Sky, in the world's panorama frame.
        sun: (direction (3,), radius in degrees, radiance (3,)).
        lamps: list of (centre (3,), radius, radiance (3,)). Glowing balls.
    """

    def __init__(self, picture: NDArray[np.float32], sun: Any, lamps: list[Lamp]):
        h, w = picture.shape[:2]
        padded = np.concatenate([picture[:, -1:], picture, picture[:, :1]], axis=1)
        self.width = w
        self.texture = mi.Texture2f(
            mi.TensorXf(np.ascontiguousarray(padded)), wrap_mode=dr.WrapMode.Clamp
        )
        toward, radius, colour = sun
        self.sun_frame = mi.Frame3f(vec(toward))
        self.sun_cosine = float(np.cos(np.radians(radius)))
        self.sun_density = float(1 / (2 * np.pi * (1 - self.sun_cosine)))
        self.sun_radiance = mi.Color3f(*[float(c) for c in colour])
        self._sky_table(picture.reshape(h // 4, 4, w // 4, 4, 3).mean(axis=(1, 3)))
        self.lamps = lamps

    def _sky_table(self, small: Floats) -> None:
        rows, columns = small.shape[:2]
        edges = np.sin(np.pi * (0.5 - np.arange(rows + 1) / rows))
        area = (edges[:-1] - edges[1:]) * 2 * np.pi / columns
        value = small @ np.array([0.2126, 0.7152, 0.0722])
        value[rows // 2 :] = 0
        weight = value * area[:, None]
        self.rows, self.columns = rows, columns
        self.sky = mi.DiscreteDistribution(weight.astype(np.float32).ravel())
        self.sky_density = mi.Float((value / weight.sum()).astype(np.float32).ravel())

    def escaped(self, d: Any) -> tuple[Any, Any]:
        """Return the radiance of the sky, and of the sun's disc, in a direction."""
        azimuth = dr.atan2(-d.x, d.z)
        u = azimuth / (2 * np.pi) + 0.5
        v = 0.5 - dr.asin(dr.clip(d.y, -1, 1)) / np.pi
        at = mi.Point2f((u * self.width + 1) / (self.width + 2), v)
        colour = self.texture.eval(at)
        disc = dr.dot(d, self.sun_frame.n) > self.sun_cosine
        return mi.Color3f(*colour), dr.select(disc, self.sun_radiance, 0)

    def sky_pdf(self, d: Any) -> Any:
        """Return the density of `sample_sky` per solid angle."""
        u = dr.atan2(-d.x, d.z) / (2 * np.pi) + 0.5
        v = 0.5 - dr.asin(dr.clip(d.y, -1, 1)) / np.pi
        column = dr.clip(mi.Int32(u * self.columns), 0, self.columns - 1)
        row = dr.clip(mi.Int32(v * self.rows), 0, self.rows - 1)
        return dr.gather(mi.Float, self.sky_density, mi.UInt32(row * self.columns + column))

    def sample_sky(self, pick: Any, u: Any) -> Any:
        """Return a direction toward the sky, bright parts more often."""
        index = self.sky.sample(pick)
        row, column = mi.Float(index // self.columns), mi.Float(index % self.columns)
        azimuth = 2 * np.pi * ((column + u.x) / self.columns - 0.5)
        low = dr.sin(np.pi * (0.5 - (row + 1) / self.rows))
        high = dr.sin(np.pi * (0.5 - row / self.rows))
        y = low + (high - low) * u.y
        r = dr.safe_sqrt(1 - y * y)
        return mi.Vector3f(-dr.sin(azimuth) * r, y, dr.cos(azimuth) * r)

    def sample_sun(self, u: Any) -> Any:
        """Return a direction to a point of the sun's disc."""
        return self.sun_frame.to_world(mi.warp.square_to_uniform_cone(u, self.sun_cosine))

    def sample_lamp(self, p: Any, n: Any, pick: Any, u: Any) -> tuple[Any, Any, Any, Any]:
        """Return the direction to a lamp (a ball), its distance, density and radiance."""
        weights, total = [], mi.Float(0)
        for centre, radius, glow in self.lamps:
            way = mi.Vector3f(vec(centre) - p)
            square = dr.squared_norm(way)
            seen = dr.maximum(dr.dot(n, way) * dr.rsqrt(square), 0) + 0.02
            weights.append(float(glow @ LUMINANCE) * radius**2 * seen / square)
            total += weights[-1]
        low, pick = mi.Float(0), pick * total
        middle, size, radiance, share = mi.Point3f(0), mi.Float(0), mi.Color3f(0), mi.Float(0)
        for (centre, radius, glow), weight in zip(self.lamps, weights, strict=True):
            chosen = (pick >= low) & (pick < low + weight)
            middle = dr.select(chosen, mi.Point3f(vec(centre)), middle)
            size = dr.select(chosen, radius, size)
            radiance = dr.select(chosen, mi.Color3f(*[float(g) for g in glow]), radiance)
            share = dr.select(chosen, weight / total, share)
            low += weight
        way = mi.Vector3f(middle - p)
        far = dr.norm(way)
        cosine = dr.safe_sqrt(1 - dr.square(size / far))
        d = mi.Frame3f(way / far).to_world(mi.warp.square_to_uniform_cone(u, cosine))
        density = share * dr.rcp(2 * np.pi * dr.maximum(1 - cosine, 1e-7))
        return d, far - 1.15 * size, dr.select(far > 1.2 * size, density, 0), radiance


def _finish(m: dict[str, Any], wi: Any, wo: Any) -> tuple[Any, Any]:
    """Return reflectance times cosine, and `_bounce`'s density, for world directions."""
    ci, co = dr.dot(m["n"], wi), dr.dot(m["n"], wo)
    same = (co > 0) & (dr.dot(m["g"], wo) > 0)
    other = (co < 0) & (dr.dot(m["g"], wo) < 0)
    glossy = m["rough"] > 0
    alpha2 = dr.square(dr.maximum(m["rough"], 0.02))
    h = dr.normalize(wi + wo)
    ch, cd = dr.dot(m["n"], h), dr.dot(wi, h)
    d = alpha2 / (np.pi * dr.square(ch * ch * (alpha2 - 1) + 1))
    shade = dr.rcp(
        (ci + dr.sqrt(alpha2 + (1 - alpha2) * ci * ci))
        * (co + dr.sqrt(alpha2 + (1 - alpha2) * co * co))
    )

    def fresnel(c: Any) -> Any:
        k = 1 - dr.clip(c, 0, 1)
        return m["f0"] + (1 - m["f0"]) * k * k * k * k * k

    under = dr.select(glossy, (1 - fresnel(ci)) * (1 - fresnel(co)), 1)
    value = m["albedo"] * (dr.inv_pi * under * (1 - m["thin"]))
    value += dr.select(glossy, fresnel(cd) * d * shade, 0)
    value *= co
    spread = co * dr.inv_pi * (1 - m["thin"])
    lobe = d * ch / (4 * dr.maximum(cd, 1e-4))
    density = dr.select(glossy, 0.6 * spread + 0.4 * lobe, spread)
    through = m["albedo"] * (dr.inv_pi * m["thin"] * -co)
    value = dr.select(same, value, dr.select(other & (m["thin"] > 0), through, 0))
    density = dr.select(same, density, dr.select(other, -co * dr.inv_pi * m["thin"], 0))
    return value, density


def _bounce(m: dict[str, Any], wi: Any, pick: Any, u: Any) -> Any:
    """Sample a direction from the surface's finish."""
    frame = mi.Frame3f(m["n"])
    flat = mi.warp.square_to_cosine_hemisphere(u)
    flat.z = dr.select((pick < m["thin"]) & (m["rough"] <= 0), -flat.z, flat.z)
    alpha2 = dr.square(dr.maximum(m["rough"], 0.02))
    c = dr.sqrt((1 - u.x) / (1 + (alpha2 - 1) * u.x))
    s = dr.safe_sqrt(1 - c * c)
    h = frame.to_world(mi.Vector3f(s * dr.cos(2 * np.pi * u.y), s * dr.sin(2 * np.pi * u.y), c))
    mirrored = h * (2 * dr.dot(wi, h)) - wi
    return dr.select((m["rough"] > 0) & (pick < 0.4), mirrored, frame.to_world(flat))


def _direct(
    m: dict[str, Any],
    wi: Any,
    guide: Any,
    world: tuple[Surfaces, Lights, Portals],
    sampler: Any,
    active: Any,
) -> Any:
    """Return the light of the sun, and of the lamps indoors or of the sky outdoors."""
    _, lights, _ = world
    indoors = guide[0]
    pick, u, again = sampler.next_1d(), sampler.next_2d(), sampler.next_2d()
    # Indoors the sky is sampled through the openings; outdoors the lamps are too weak to matter.
    lamp_way, far, lamp_density, glow = lights.sample_lamp(m["p"], m["n"], pick, u)
    sky_way = lights.sample_sky(pick, u)
    sky_light, _ = lights.escaped(sky_way)
    way = dr.select(indoors, lamp_way, sky_way)
    light = dr.select(indoors, glow, sky_light)
    density = dr.select(indoors, lamp_density, lights.sky_pdf(sky_way))
    limit = dr.select(indoors, far, 1e6)
    # Indoors the lamps are only sampled in this way, so no weight is shared with other rays.
    share = mi.Bool(~indoors)
    total = _lit(m, wi, (way, light, density, limit, share), guide, world, active)
    sun = (
        lights.sample_sun(again),
        lights.sun_radiance,
        mi.Float(lights.sun_density),
        mi.Float(1e6),
        True,
    )
    return total + _lit(m, wi, sun, guide, world, active)


def _lit(m: dict[str, Any], wi: Any, light: Any, guide: Any, world: Any, active: Any) -> Any:
    """Return the light from one sampled direction, if it is not blocked."""
    surfaces, _, portals = world
    way, colour, density, limit, share = light
    value, own = _finish(m, wi, way)
    own = dr.select(share, _mixed(own, guide, portals, m["p"], way), 0)
    useful = active & (dr.max(value) > 0) & (density > 0)
    origin = m["p"] + m["g"] * (dr.select(dr.dot(m["g"], way) > 0, 1.0, -1.0) * _gap(m["p"]))
    shadow = surfaces.scene.ray_test(mi.Ray3f(origin, way, limit, 0, []), False, useful)
    return dr.select(useful & ~shadow, value * colour / (density + own), 0)


def _mixed(own: Any, guide: Any, portals: Portals, p: Any, way: Any) -> Any:
    indoors, shares = guide
    return dr.select(indoors, (1 - _GUIDED) * own + _GUIDED * portals.pdf(p, shares, way), own)


def _gap(p: Any) -> Any:
    return 4e-5 * (1 + dr.max(dr.abs(p)))


@dr.syntax  # type: ignore[untyped-decorator]
def radiance(world: Any, sampler: Any, ray: Any) -> Any:
    """Return the radiance along rays, (N,) colours."""
    surfaces, lights, portals = world
    ray = mi.Ray3f(ray)
    total, beta = mi.Color3f(0), mi.Color3f(1)
    density, room = mi.Float(-1), mi.Bool(False)
    depth, active = mi.UInt32(0), mi.Bool(True)
    while active:
        m = surfaces.meet(ray, sampler.next_2d(), depth == 0, active)
        heaven, disc = lights.escaped(ray.d)
        gone = active & ~m["valid"]
        sky_share = _share(density, dr.select(room, 0, lights.sky_pdf(ray.d)))
        sun_share = _share(density, mi.Float(lights.sun_density))
        total += dr.select(gone, beta * (heaven * sky_share + disc * sun_share), 0)
        # From indoors the lamps are sampled, so they count only where a camera sees them.
        seen = m["valid"] & ((density < 0) | ~room | ~m["ball"])
        total += dr.select(seen, beta * m["glow"], 0)

        active &= m["valid"] & (depth < _DEPTH - 1)
        wi = -ray.d
        room = portals.inside(m["p"])
        shares = portals.shares(m["p"], m["n"])
        total += beta * _direct(m, wi, (room, shares), world, sampler, active)

        through = room & (sampler.next_1d() < _GUIDED)
        out = portals.sample(m["p"], shares, sampler.next_1d(), sampler.next_2d())
        way = dr.select(through, out, _bounce(m, wi, sampler.next_1d(), sampler.next_2d()))
        value, own = _finish(m, wi, way)
        density = _mixed(own, (room, shares), portals, m["p"], way)
        active &= (density > 1e-9) & (dr.max(value) > 0)
        beta *= dr.select(active, value / density, 0)
        side = dr.select(dr.dot(m["g"], way) > 0, 1.0, -1.0)
        ray = mi.Ray3f(m["p"] + m["g"] * (side * _gap(m["p"])), way)
        depth += 1
        keep = dr.select(depth >= _ROULETTE, dr.clip(dr.max(beta), 0.1, 0.95), 1)
        active &= sampler.next_1d() < keep
        beta /= keep
    return total


def _share(density: Any, rival: Any) -> Any:
    """Return the weight by the balance heuristic; a camera ray (density below 0) counts in full."""
    return dr.select(density < 0, 1.0, density / dr.maximum(density + rival, 1e-20))


def first_hit(surfaces: Surfaces, ray: Any) -> tuple[Any, Any, Any]:
    """Return distance (0 for the sky), albedo and normal at the rays' first hits."""
    m = surfaces.meet(mi.Ray3f(ray), mi.Point2f(0.5), mi.Bool(True), mi.Bool(True))
    return m["t"], dr.select(m["valid"], m["albedo"], 0), dr.select(m["valid"], m["n"], 0)
