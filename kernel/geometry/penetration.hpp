// The penetration depth of two convex cores that overlap, one configuration at a time, in double.
//
// A hull inside A - B grows towards where its surface is nearest to the origin (expanding polytope; van den Bergen,
// 2001). Each step has a direction n, the normal of the nearest face, and the support h(n) = greatest n . x over A - B.
// The depth is the least h(n) over all directions: so every step gives an upper bound of the depth, and the nearest
// face a lower bound.
#pragma once

#include <array>
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

// A hull of points, its faces with outward normals.
class growing_hull {
  public:
    struct face {
        int corner[3];
        point3 normal;
        double distance;  // of its plane from the origin, along the normal; infinite where the hull is not to grow
    };
    std::vector<point3> points;
    std::vector<face> faces;

    void begin(const point3 (&corners)[4]) {
        points.assign(corners, corners + 4);
        faces.clear();
        const bool turned = dot(cross(corners[1] - corners[0], corners[2] - corners[0]), corners[3] - corners[0]) > 0;
        const int b = turned ? 2 : 1, c = turned ? 1 : 2;
        add(0, b, c);
        add(0, 3, b);
        add(b, 3, c);
        add(c, 3, 0);
    }
    // Adds a point that lies outside a face: it and what hangs together with it, as far as the point sees it, goes.
    // False if rounding has torn the surface: then the hull is of no more use.
    bool grow(std::size_t outside_of, const point3& w, double rounding) {
        std::swap(faces[0], faces[outside_of]);
        std::size_t gone = 1, seen = 1;
        for (std::size_t i = 1; i < faces.size(); ++i) {
            if (dot(faces[i].normal, w - points[faces[i].corner[0]]) > rounding) std::swap(faces[i], faces[seen++]);
        }
        for (std::size_t at = 0; at < gone; ++at) {
            for (std::size_t i = gone; i < seen; ++i) {
                if (share_edge(faces[at], faces[i])) std::swap(faces[i], faces[gone++]);
            }
        }
        edges_.clear();
        for (std::size_t i = 0; i < gone; ++i) {
            for (int k = 0; k < 3; ++k) cross_edge(faces[i].corner[k], faces[i].corner[(k + 1) % 3]);
        }
        for (std::size_t i = gone; i-- > 0;) {
            faces[i] = faces.back();
            faces.pop_back();
        }
        points.push_back(w);
        for (const auto& [from, to] : edges_) add(from, to, static_cast<int>(points.size()) - 1);
        return faces.size() <= 2 * points.size();
    }
    // The face whose plane is nearest; none: faces.size().
    std::size_t nearest() const {
        std::size_t best = faces.size();
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < faces.size(); ++i) {
            if (faces[i].distance < least) {
                least = faces[i].distance;
                best = i;
            }
        }
        return best;
    }

  private:
    std::vector<std::array<int, 2>> edges_;
    static bool share_edge(const face& a, const face& b) {
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) {
                if (a.corner[i] == b.corner[(k + 1) % 3] && a.corner[(i + 1) % 3] == b.corner[k]) return true;
            }
        }
        return false;
    }
    // An edge between two faces that both go is no rim.
    void cross_edge(int from, int to) {
        for (auto& e : edges_) {
            if (e[0] == to && e[1] == from) {
                e = edges_.back();
                edges_.pop_back();
                return;
            }
        }
        edges_.push_back({from, to});
    }
    void add(int a, int b, int c) {
        const point3 n = cross(points[b] - points[a], points[c] - points[a]);
        const double size = length_of(n);
        if (!(size > 0)) {
            faces.push_back({{a, b, c}, {0, 0, 0}, std::numeric_limits<double>::infinity()});
            return;
        }
        const point3 unit = scaled(n, 1 / size);
        faces.push_back({{a, b, c}, unit, dot(unit, points[a])});
    }
};

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
    if (!spanning(d, rounding, corner, flat))
        return std::min(known, std::min(support(flat), support(scaled(flat, -1))));
    static thread_local growing_hull hull;
    hull.begin(corner);
    double depth = known;
    while (hull.points.size() < most_points) {
        const std::size_t at = hull.nearest();
        if (at == hull.faces.size()) break;
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
