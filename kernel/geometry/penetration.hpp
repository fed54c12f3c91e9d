// The penetration depth of two convex cores that overlap, one configuration at a time, in double.
//
// A hull inside A - B grows towards where its surface is nearest to the origin (expanding polytope; van den Bergen,
// 2001). Each step has a direction n, the normal of the nearest face, and the support h(n) = greatest n . x over A - B.
// The depth is the least h(n) over all directions: so every step gives an upper bound of the depth, and the nearest
// face a lower bound.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "geometry/gjk.hpp"

namespace SPACEARM_NAMESPACE {

namespace convex_detail {

struct point3 {
    double x, y, z;
};
inline point3 operator-(const point3& a, const point3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline double dot(const point3& a, const point3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline point3 cross(const point3& a, const point3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline point3 scaled(const point3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double length_of(const point3& a) { return std::sqrt(dot(a, a)); }

// A point of a core that is furthest along a direction, in the core's own frame.
template <class T> point3 furthest(const convex_shape<T>& s, const point3& n) {
    const auto along = [](double d, T half) { return d < 0 ? -double(half) : double(half); };
    if (s.kind == core_kind::segment) return {0, 0, along(n.z, s.half[2])};
    if (s.kind == core_kind::box) return {along(n.x, s.half[0]), along(n.y, s.half[1]), along(n.z, s.half[2])};
    if (s.kind == core_kind::cylinder) {
        const double across = std::sqrt(n.x * n.x + n.y * n.y);
        const double factor = across > 0 ? double(s.half[0]) / across : 0;
        return {n.x * factor, n.y * factor, along(n.z, s.half[2])};
    }
    int best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < s.count; ++i) {
        const double d =
            n.x * double(s.vertices[i][0]) + n.y * double(s.vertices[i][1]) + n.z * double(s.vertices[i][2]);
        if (d > most) {
            most = d;
            best = i;
        }
    }
    return {double(s.vertices[best][0]), double(s.vertices[best][1]), double(s.vertices[best][2])};
}

// How far a core goes from its origin, at most.
template <class T> double extent(const convex_shape<T>& s) {
    if (s.kind != core_kind::polytope) return length_of({double(s.half[0]), double(s.half[1]), double(s.half[2])});
    double most = 0;
    for (int i = 0; i < s.count; ++i) {
        const T* v = s.vertices[i];
        most = std::max(most, double(v[0]) * double(v[0]) + double(v[1]) * double(v[1]) + double(v[2]) * double(v[2]));
    }
    return std::sqrt(most);
}

// A - B in A's frame.
template <class T> struct difference {
    const convex_shape<T>&a, &b;
    const rotation3& axes;  // B's in A's frame
    point3 origin;
    point3 furthest_along(const point3& n) const {
        const auto in_b = [&](int k) { return -(axes.c[k][0] * n.x + axes.c[k][1] * n.y + axes.c[k][2] * n.z); };
        const point3 p = furthest(a, n), q = furthest(b, point3{in_b(0), in_b(1), in_b(2)});
        const auto placed = [&](int r) { return axes.c[0][r] * q.x + axes.c[1][r] * q.y + axes.c[2][r] * q.z; };
        return {p.x - origin.x - placed(0), p.y - origin.y - placed(1), p.z - origin.z - placed(2)};
    }
};

// A hull of points: triangles with outward normals, each of which knows the one across each of its edges.
class growing_hull {
  public:
    struct face {
        int corner[3];
        int beside[3];  // the face across the edge from corner k to the next
        point3 normal;
        double distance;  // of its plane from the origin, along the normal; infinite where the hull is not to grow
        bool gone;
    };
    std::vector<point3> points;
    std::vector<face> faces;  // also those that are gone

    void begin(const point3 (&corners)[4]) {
        points.assign(corners, corners + 4);
        faces.clear();
        const bool turned = dot(cross(corners[1] - corners[0], corners[2] - corners[0]), corners[3] - corners[0]) > 0;
        const int b = turned ? 2 : 1, c = turned ? 1 : 2;
        add(0, b, c, 1, 2, 3);
        add(0, 3, b, 3, 2, 0);
        add(b, 3, c, 1, 3, 0);
        add(c, 3, 0, 2, 1, 0);
    }
    // Adds a point that lies outside a face: this and what hangs together with it, as far as the point sees it, goes.
    // False if rounding has torn the surface: then the hull is of no more use.
    bool grow(int outside_of, const point3& w, double rounding) {
        rim_.clear();
        remove(outside_of);
        for (int k = 0; k < 3; ++k) look(outside_of, k, w, rounding);
        const int rim = static_cast<int>(rim_.size()), first = static_cast<int>(faces.size());
        points.push_back(w);
        for (int i = 0; i < rim; ++i) {
            const auto& [from, to, beyond, edge] = rim_[i];
            if (rim < 3 || to != rim_[(i + 1) % rim].from) return false;
            faces[beyond].beside[edge] = first + i;
            add(from, to, static_cast<int>(points.size()) - 1, beyond, first + (i + 1) % rim,
                first + (i + rim - 1) % rim);
        }
        return rim > 0;
    }
    // The face whose plane is nearest; -1: none.
    int nearest() const {
        int best = -1;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < faces.size(); ++i) {
            if (faces[i].distance < least) {
                least = faces[i].distance;
                best = static_cast<int>(i);
            }
        }
        return best;
    }

  private:
    struct rim_edge {
        int from, to;      // as the face that goes has it
        int beyond, edge;  // the face that stays, and which of its edges it is
    };
    std::vector<rim_edge> rim_;

    void remove(int i) {
        faces[i].gone = true;
        faces[i].distance = std::numeric_limits<double>::infinity();
    }
    // Across an edge of a face that goes, in the order in which the edges of the rim follow each other.
    void look(int i, int k, const point3& w, double rounding) {
        const int from = faces[i].corner[k], to = faces[i].corner[(k + 1) % 3], beyond = faces[i].beside[k];
        const face& f = faces[beyond];
        if (f.gone) return;
        const int edge = f.corner[0] == to ? 0 : f.corner[1] == to ? 1 : 2;
        if (dot(f.normal, w - points[f.corner[0]]) > rounding) {
            remove(beyond);
            look(beyond, (edge + 1) % 3, w, rounding);
            look(beyond, (edge + 2) % 3, w, rounding);
        } else rim_.push_back({from, to, beyond, edge});
    }
    void add(int a, int b, int c, int across_ab, int across_bc, int across_ca) {
        const point3 n = cross(points[b] - points[a], points[c] - points[a]);
        const double size = length_of(n), infinite = std::numeric_limits<double>::infinity();
        const point3 unit = size > 0 ? scaled(n, 1 / size) : point3{0, 0, 0};
        const double distance = size > 0 ? dot(unit, points[a]) : infinite;
        faces.push_back({{a, b, c}, {across_ab, across_bc, across_ca}, unit, distance, false});
    }
};

// Four points that span a body which is not thin: the furthest along the diagonals of a cube.
template <class T> bool quickly_spanning(const difference<T>& d, double size, point3 (&corner)[4]) {
    const point3 diagonals[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    for (int i = 0; i < 4; ++i) corner[i] = d.furthest_along(diagonals[i]);
    const point3 n = cross(corner[1] - corner[0], corner[2] - corner[0]);
    return std::abs(dot(n, corner[3] - corner[0])) > 1e-4 * size * size * size;
}
// Four points that span the difference, or the direction in which it is flat: `flat` is then a unit vector.
template <class T> bool spanning(const difference<T>& d, double rounding, point3 (&corner)[4], point3& flat) {
    double widest = -1;
    const auto between = [&](const point3& n, const point3& from, double& found) {  // the further of both ends
        const point3 one = d.furthest_along(n), two = d.furthest_along(scaled(n, -1));
        const double up = std::abs(dot(n, one - from)), down = std::abs(dot(n, two - from));
        found = std::max(up, down);
        return up < down ? two : one;
    };
    const point3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const point3& n : axes) {
        const point3 one = d.furthest_along(n), two = d.furthest_along(scaled(n, -1));
        const double width = length_of(one - two);
        if (width > widest) {
            widest = width;
            corner[0] = one;
            corner[1] = two;
        }
    }
    if (!(widest > rounding)) return flat = {1, 0, 0}, false;
    const point3 along = scaled(corner[1] - corner[0], 1 / length_of(corner[1] - corner[0]));
    point3 least = axes[0];
    for (const point3& n : axes) {
        if (std::abs(dot(n, along)) < std::abs(dot(least, along))) least = n;
    }
    point3 side = cross(along, least);
    side = scaled(side, 1 / length_of(side));
    const point3 other = cross(along, side);
    double width = 0, second = 0;
    corner[2] = between(side, corner[0], width);
    const point3 found = between(other, corner[0], second);
    if (second > width) {
        width = second;
        corner[2] = found;
    }
    if (!(width > rounding)) return flat = side, false;
    point3 up = cross(along, corner[2] - corner[0]);
    up = scaled(up, 1 / length_of(up));
    corner[3] = between(up, corner[0], width);
    flat = up;
    return width > rounding;
}

// The penetration depth of the cores [m]: the least support of A - B, and not more than is known of it. Negative if
// they are apart, by at most their distance. B's axes and origin are given in A's frame.
//
// Around the axis of a cylinder many directions may be as good: their number is limited, and the depth found then is
// too large by what the faces between them leave out.
template <class T>
double penetration_depth(const convex_shape<T>& a, const convex_shape<T>& b, const rotation3& axes,
                         const double* origin, double known) {
    constexpr bool single = sizeof(T) == 4;
    constexpr std::size_t most_points = single ? 64 : 256;
    const difference<T> d{a, b, axes, {origin[0], origin[1], origin[2]}};
    point3 corner[4], flat{};
    const double size = extent(a) + extent(b) + length_of(d.origin), rounding = 1e-14 * size;
    const auto support = [&](const point3& n) { return dot(n, d.furthest_along(n)); };
    if (!quickly_spanning(d, size, corner) && !spanning(d, rounding, corner, flat))
        return std::min(known, std::min(support(flat), support(scaled(flat, -1))));
    static thread_local growing_hull hull;
    hull.begin(corner);
    double depth = known;
    while (hull.points.size() < most_points) {
        const int at = hull.nearest();
        if (at < 0) break;
        growing_hull::face& f = hull.faces[at];
        const double close = single ? 1e-6 * size + 5e-4 * std::abs(depth) : 1e-11 * size;
        if (!(f.distance + close < depth)) break;
        const point3 w = d.furthest_along(f.normal);
        const double h = dot(f.normal, w);
        depth = std::min(depth, h);
        if (!(f.distance + rounding < h)) f.distance = std::numeric_limits<double>::infinity();
        else if (!hull.grow(at, w, rounding)) break;
    }
    return depth;
}

}  // namespace convex_detail
}  // namespace SPACEARM_NAMESPACE
