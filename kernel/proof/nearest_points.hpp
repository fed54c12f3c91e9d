// The clearance of two convex bodies, and the direction in which they are apart; scalar float64.
//
// A body is all within a radius of its core. A core is the hull of points, and may be widened by a disc across an axis:
// a cylinder is its two lids' middles and a disc. The direction is found, and then what it is worth is computed: the
// least extent of one core along it less the greatest of the other one. This gap is what a plane square to the
// direction proves, whatever went wrong before.
//
// Points, segments, boxes and cylinders against a point, and two segments, have closed forms. All else is found by GJK
// (Gilbert, Johnson and Keerthi, 1988): up to four points of A - B are kept, and the nearest point of their hull to the
// origin gives the next direction. All parts of the hull that contain the newest point are tried, and the nearest is
// taken. So no case distinction can go wrong by rounding. A direction is square to its edge or triangle to the last
// place: where bodies all but touch, the least tilt costs clearance.
#pragma once

#include <cmath>
#include <limits>

namespace spacearm_proof {

// A convex body in world coordinates [m].
struct PlacedBody {
    const double* points;  // (count, 3)
    int count;
    double disc;      // the radius of the disc that widens the hull of the points; 0: none
    double axis[3];   // unit, of the disc or the half-space
    double radius;    // of the body around its core
    bool half_space;  // all that lies below the only point along the axis; then nothing else counts
};

struct Nearest {
    double clearance;  // [m]; 0 or less where cores or radii overlap
    double n[3];       // unit, from b to a
    bool apart;        // whether n separates the cores
};

namespace nearest {

struct Vec {
    double x, y, z;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator-(Vec a) { return {-a.x, -a.y, -a.z}; }
inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline bool same(Vec a, Vec b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
inline double largest(Vec a) { return std::fmax(std::fabs(a.x), std::fmax(std::fabs(a.y), std::fabs(a.z))); }
inline Vec at(const double* p) { return {p[0], p[1], p[2]}; }
inline Vec point(const PlacedBody& b, int i) { return at(b.points + 3 * i); }

// The unit vector along v; 0 for a vector without a direction.
inline Vec unit(Vec v) {
    const double size = largest(v);
    if (!(size > 0.0) || !(size < std::numeric_limits<double>::infinity())) return {0, 0, 0};
    if (size < 1e-100) v = (1.0 / size) * v;  // its square would underflow
    return (1.0 / std::sqrt(dot(v, v))) * v;
}
inline bool is_none(Vec n) { return n.x == 0.0 && n.y == 0.0 && n.z == 0.0; }

// The point of a core that is furthest along a direction.
inline Vec furthest(const PlacedBody& b, Vec n) {
    int best = 0;
    double most = dot(n, point(b, 0));
    for (int i = 1; i < b.count; ++i) {
        const double along = dot(n, point(b, i));
        if (along > most) most = along, best = i;
    }
    const Vec p = point(b, best);
    if (b.disc == 0.0) return p;
    const Vec axis = at(b.axis), across = n - dot(n, axis) * axis;
    return p + b.disc * unit(across - dot(across, axis) * axis);
}

// A vector from b's core to a's that is about as short as any.
struct Shortest {
    Vec n;       // unit, along it; 0: the cores meet
    double gap;  // of the cores along n
};

// The shortest vector from the segment p to q to the origin, square to the segment where it ends within.
inline Vec to_origin(Vec p, Vec q) {
    const Vec e = q - p;
    const double square = dot(e, e), along = -dot(p, e);
    if (!(along > 0.0) || !(square > 0.0)) return p;
    if (along >= square) return q;
    const Vec v = p + (along / square) * e;
    return v - (dot(v, e) / square) * e;
}

// ---- closed forms ---------------------------------------------------------------------------------------------------

inline Shortest along(Vec v) {
    const Vec n = unit(v);
    return {n, dot(n, v)};
}

// Two segments; c is the first point of the first one seen from that of the second one.
inline Shortest of_segments(Vec c, Vec d, Vec e) {
    const Vec ends[4] = {to_origin(c, c - e), to_origin(c + d, c + d - e), to_origin(c, c + d),
                         to_origin(c - e, c - e + d)};
    Vec v = ends[0];
    for (int i = 1; i < 4; ++i)
        if (dot(ends[i], ends[i]) < dot(v, v)) v = ends[i];
    const Vec normal = cross(d, e);
    const double square = dot(normal, normal);
    if (!(square > 1e-24 * dot(d, d) * dot(e, e))) return along(v);
    const double s = -dot(cross(c, e), normal) / square, t = -dot(cross(c, d), normal) / square;
    if (!(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0)) return along(v);
    Vec n = unit(normal);
    double gap = dot(n, c);
    if (gap < 0.0) n = -n, gap = -gap;
    return gap > 0.0 ? Shortest{n, gap} : Shortest{{0, 0, 0}, 0.0};
}

// A point x, and a cylinder's core: points p and q, and a disc across the axis.
inline Shortest of_cylinder(Vec x, Vec p, Vec q, double disc, Vec axis) {
    const Vec c = x - 0.5 * (p + q);
    const double height = dot(c, axis), half = 0.5 * std::fabs(dot(q - p, axis));
    Vec across = c - height * axis;
    across = across - dot(across, axis) * axis;
    const double wide = std::sqrt(dot(across, across));
    const double up = std::fmax(0.0, std::fabs(height) - half), out = std::fmax(0.0, wide - disc);
    const Vec v = std::copysign(up, height) * axis;
    return along(out > 0.0 ? v + (out / wide) * across : v);
}

// Whether eight points are the corners of a box, in the order of the table of bodies; `edge` is set to its edges.
inline bool is_box(const PlacedBody& b, Vec (&edge)[3]) {
    if (b.count != 8 || b.disc != 0.0) return false;
    const Vec p = point(b, 0);
    edge[0] = point(b, 4) - p, edge[1] = point(b, 2) - p, edge[2] = point(b, 1) - p;
    const double square[3] = {dot(edge[0], edge[0]), dot(edge[1], edge[1]), dot(edge[2], edge[2])};
    constexpr double tilt = 1e-22;  // the square of the greatest tilt of two edges
    for (int i = 0; i < 3; ++i) {
        const int k = i == 2 ? 0 : i + 1;
        const double both = dot(edge[i], edge[k]);
        if (!(square[i] > 0.0) || !(both * both < tilt * square[i] * square[k])) return false;
    }
    const double off = 1e-11 * (largest(edge[0]) + largest(edge[1]) + largest(edge[2]));
    const Vec xy = p + edge[0] + edge[1];
    return largest(point(b, 6) - xy) < off && largest(point(b, 5) - (p + edge[0] + edge[2])) < off
           && largest(point(b, 3) - (p + edge[1] + edge[2])) < off && largest(point(b, 7) - (xy + edge[2])) < off;
}

// A point x and a box, by its edges.
inline Shortest of_box(Vec x, const PlacedBody& b, const Vec (&edge)[3]) {
    const Vec c = x - point(b, 0);
    Vec v{0, 0, 0};
    for (const Vec& e : edge) {
        const double square = dot(e, e), share = dot(c, e);
        if (share < 0.0) v = v + (share / square) * e;
        else if (share > square) v = v + ((share - square) / square) * e;
    }
    const Vec n = unit(v);
    return {n, is_none(n) ? 0.0 : dot(n, x - furthest(b, n))};
}

// ---- GJK ------------------------------------------------------------------------------------------------------------

// Up to four points of A - B, and the vector from the origin to the nearest point of their hull.
struct Simplex {
    Vec w[4];
    int count;
    Vec v;       // the vector; 0: the origin is inside
    Vec normal;  // unit, along it, and square to the edge or the triangle that it ends in
};

// The nearest part of a simplex's hull that is tried so far.
struct Part {
    double square;
    Vec v, normal;
    int corners, corner[3];
};
inline void take_if_nearer(Part& best, Vec v, Vec normal, int a, int b, int c, int corners) {
    const double square = dot(v, v);
    if (square < best.square) best = {square, v, normal, corners, {a, b, c}};
}
inline void try_edge(Part& best, const Simplex& s, int i, int newest) {
    const Vec p = s.w[newest], e = s.w[i] - p;
    const double square = dot(e, e), along = -dot(p, e);
    if (!(along > 0.0 && along < square)) return;
    const Vec v = p + (along / square) * e, flat = v - (dot(v, e) / square) * e;
    take_if_nearer(best, flat, unit(flat), newest, i, 0, 2);
}
inline void try_triangle(Part& best, const Simplex& s, int i, int k, int newest) {
    const Vec p = s.w[newest], e = s.w[i] - p, f = s.w[k] - p, normal = cross(e, f);
    const double square = dot(normal, normal);
    if (!(square > 1e-28 * dot(e, e) * dot(f, f))) return;
    const double at_i = -dot(cross(p, f), normal), at_k = -dot(cross(e, p), normal);
    if (!(at_i > 0.0 && at_k > 0.0 && at_i + at_k < square)) return;
    const double height = dot(p, normal);
    const Vec n = unit(height < 0.0 ? -normal : normal);
    take_if_nearer(best, std::fabs(height) / std::sqrt(square) * n, n, newest, i, k, 3);
}
inline bool holds_origin(const Simplex& s, double size) {
    const Vec &a = s.w[0], &b = s.w[1], &c = s.w[2], &d = s.w[3];
    const double of[4] = {dot(b, cross(c, d)), -dot(a, cross(c, d)), dot(a, cross(b, d)), -dot(a, cross(b, c))};
    const double least = 1e-15 * size * size * size;
    bool all_above = true, all_below = true;
    for (const double volume : of) all_above = all_above && volume > least, all_below = all_below && volume < -least;
    return all_above || all_below;
}

inline void keep(Simplex& s, const Part& part) {
    Vec w[3];
    for (int i = 0; i < part.corners; ++i) w[i] = s.w[part.corner[i]];
    for (int i = 0; i < part.corners; ++i) s.w[i] = w[i];
    s.count = part.corners, s.v = part.v, s.normal = part.normal;
}

// Reduce a simplex to the part of its hull that is nearest to the origin; its last point is the newest. False: no part
// is nearer than `square`.
inline bool reduce(Simplex& s, double square, double size) {
    const int newest = s.count - 1;
    if (s.count == 4 && holds_origin(s, size)) {
        s.v = {0, 0, 0};
        return true;
    }
    Part best{square, {0, 0, 0}, {0, 0, 0}, 0, {0, 0, 0}};
    take_if_nearer(best, s.w[newest], unit(s.w[newest]), newest, 0, 0, 1);
    for (int i = 0; i < newest; ++i) try_edge(best, s, i, newest);
    for (int i = 0; i < newest; ++i)
        for (int k = i + 1; k < newest; ++k) try_triangle(best, s, i, k, newest);
    if (best.corners > 0) keep(s, best);
    return best.corners > 0;
}

constexpr int most_steps = 128;         // of GJK; polytopes need about six, and two discs up to fifty
constexpr double rounding = 2e-15;      // times the size of the numbers: no gap is known better
constexpr double round_enough = 1e-11;  // [m] so near to the greatest gap a direction is as good, where a disc is round

// Where bodies all but touch, rounding hides which part of a simplex is the nearest. Then take the one that is square
// to the direction in which the lowest point of the simplex is highest. False: there is none.
inline bool lift(Simplex& s) {
    const int newest = s.count - 1;
    Part best{0.0, {0, 0, 0}, {0, 0, 0}, 0, {0, 0, 0}};
    double most = 0.0;
    const auto consider = [&](Vec n, int a, int b, int corners) {
        if (dot(n, s.w[newest]) < 0.0) n = -n;
        double least = dot(n, s.w[0]);
        for (int i = 1; i < s.count; ++i) least = std::fmin(least, dot(n, s.w[i]));
        if (least > most) most = least, best = {0.0, least * n, n, corners, {newest, a, b}};
    };
    for (int i = 0; i < newest; ++i) {
        const Vec e = s.w[i] - s.w[newest], p = s.w[newest] - (dot(s.w[newest], e) / dot(e, e)) * e;
        consider(unit(p - (dot(p, e) / dot(e, e)) * e), i, 0, 2);
        for (int k = i + 1; k < newest; ++k) consider(unit(cross(e, s.w[k] - s.w[newest])), i, k, 3);
    }
    if (best.corners > 0) keep(s, best);
    return best.corners > 0;
}

inline Shortest by_gjk(const PlacedBody& a, const PlacedBody& b, Vec first) {
    Simplex s{{furthest(a, -first) - furthest(b, first)}, 1, {}, {}};
    s.v = s.w[0], s.normal = unit(s.v);
    Shortest best{first, dot(first, s.w[0])};
    double size = largest(s.w[0]);
    const double enough = a.disc > 0.0 || b.disc > 0.0 ? round_enough : 0.0;
    for (int step = 0; step < most_steps; ++step) {
        if (is_none(s.normal)) break;
        const Vec w = furthest(a, -s.normal) - furthest(b, s.normal);
        const double gap = dot(s.normal, w), reached = dot(s.normal, s.v);
        if (gap > best.gap) best = {s.normal, gap};
        size = std::fmax(size, largest(w));
        if (reached - best.gap <= rounding * size + enough) break;
        bool seen = false;
        for (int i = 0; i < s.count; ++i) seen = seen || same(w, s.w[i]);
        if (seen) break;
        const double square = dot(s.v, s.v);
        s.w[s.count++] = w;
        if (!reduce(s, square, size)) {
            if (!lift(s)) break;
            continue;
        }
        if (!(dot(s.v, s.v) > rounding * rounding * size * size)) return {best.n, std::fmin(best.gap, 0.0)};
    }
    return best;
}

inline Vec middle(const PlacedBody& b) {
    return b.count == 1 ? point(b, 0) : 0.5 * (point(b, 0) + point(b, b.count - 1));
}

// A direction to begin with: the one that is given, or from middle to middle.
inline Vec begin(const PlacedBody& a, const PlacedBody& b, const double* guess) {
    Vec n = guess == nullptr ? Vec{0, 0, 0} : unit(at(guess));
    if (is_none(n)) n = unit(middle(a) - middle(b));
    return is_none(n) ? Vec{0, 0, 1} : n;
}

inline Nearest of_half_space(const PlacedBody& a, const PlacedBody& b) {
    const Vec n = at(b.axis);
    if (a.half_space) return {0.0, {n.x, n.y, n.z}, false};
    const double gap = dot(n, furthest(a, -n) - point(b, 0));
    return {gap - a.radius, {n.x, n.y, n.z}, gap > 0.0};
}

// A point x and the core of another body. False: there is no closed form.
inline bool of_point(Vec x, const PlacedBody& b, Shortest& out) {
    Vec edge[3];
    if (b.disc > 0.0 && b.count <= 2) out = of_cylinder(x, point(b, 0), point(b, b.count - 1), b.disc, at(b.axis));
    else if (b.count == 1) out = along(x - point(b, 0));
    else if (b.count == 2) out = along(to_origin(x - point(b, 0), x - point(b, 1)));
    else if (is_box(b, edge)) out = of_box(x, b, edge);
    else return false;
    return true;
}

inline Shortest shortest(const PlacedBody& a, const PlacedBody& b, const double* guess) {
    Shortest out;
    if (a.count == 1 && a.disc == 0.0 && of_point(point(a, 0), b, out)) return out;
    if (b.count == 1 && b.disc == 0.0 && of_point(point(b, 0), a, out)) return {-out.n, out.gap};
    if (a.count == 2 && b.count == 2 && a.disc == 0.0 && b.disc == 0.0) {
        const Vec p = point(a, 0), q = point(b, 0);
        return of_segments(p - q, point(a, 1) - p, point(b, 1) - q);
    }
    return by_gjk(a, b, begin(a, b, guess));
}

}  // namespace nearest

// Return the clearance of two bodies and the direction in which they are apart. guess: a direction (3,) from b to a
// that may be about right, such as the one found a moment before; it only saves time.
inline Nearest nearest_points(const PlacedBody& a, const PlacedBody& b, const double* guess = nullptr) {
    if (b.half_space) return nearest::of_half_space(a, b);
    if (a.half_space) {
        const Nearest out = nearest::of_half_space(b, a);
        return {out.clearance, {-out.n[0], -out.n[1], -out.n[2]}, out.apart};
    }
    const nearest::Shortest out = nearest::shortest(a, b, guess);
    const bool apart = out.gap > 0.0;
    const nearest::Vec n = nearest::is_none(out.n) ? nearest::begin(a, b, guess) : out.n;
    return {(apart ? out.gap : 0.0) - a.radius - b.radius, {n.x, n.y, n.z}, apart};
}

}  // namespace spacearm_proof
