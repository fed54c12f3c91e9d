// What a proof is about, as tables: the joints of a robot, the convex bodies, the pairs that are kept apart and what
// they are held to. The tables are those of `proof/convex_bodies.py` and `proof/claim.py`, which say what they mean.
//
// Frames are 3 x 4 matrices, row by row: the axes and the origin.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace spacearm_proof {

inline constexpr int world = 0, base_frame = 1, first_joint = 2;  // frames

struct Vec3 {
    double x, y, z;
};
inline Vec3 vec3(const double* p) { return {p[0], p[1], p[2]}; }
inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }

struct Frame {
    double T[12];
    Vec3 axis(int i) const { return {T[i], T[4 + i], T[8 + i]}; }
    Vec3 origin() const { return {T[3], T[7], T[11]}; }
    Vec3 turned(Vec3 v) const {
        return {T[0] * v.x + T[1] * v.y + T[2] * v.z, T[4] * v.x + T[5] * v.y + T[6] * v.z,
                T[8] * v.x + T[9] * v.y + T[10] * v.z};
    }
    Vec3 turned_back(Vec3 v) const { return {dot(axis(0), v), dot(axis(1), v), dot(axis(2), v)}; }
    Vec3 placed(Vec3 v) const { return turned(v) + origin(); }
};
inline Frame product(const Frame& a, const Frame& b) {
    Frame out;
    for (int i = 0; i < 3; ++i) {
        const double* row = a.T + 4 * i;
        for (int k = 0; k < 4; ++k)
            out.T[4 * i + k] = row[0] * b.T[k] + row[1] * b.T[4 + k] + row[2] * b.T[8 + k] + (k == 3 ? row[3] : 0.0);
    }
    return out;
}
inline Frame identity() { return {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}; }

// The value of a joint is multiplier * q[dof] + offset; parents come before children.
struct Joints {
    int count = 0, dofs = 0;
    std::vector<int> parent, dof;
    std::vector<char> revolute;
    std::vector<double> multiplier, offset;
    std::vector<Frame> placement;  // in the parent's frame at value 0
};

struct Body {
    int frame, first_point, points, first_member, members, owner;
    bool half_space;
    double disc, radius, reach;
    Vec3 axis, center;
};

struct Bodies {
    std::vector<Body> list;
    std::vector<double> vertices;  // in the frames of their bodies
    int count() const { return static_cast<int>(list.size()); }
    const Body& operator[](int i) const { return list[i]; }
};

// How one frame moves in another one: the joints between the two, from the other frame to this one; or, where the arm
// moves the base, all joints.
struct RelativeMotion {
    int moved, seen_from, rank;  // rank: among the motions of the frame `moved`
    bool free;
    std::vector<int> joints;
    std::vector<double> sign;   // of each: 1, -1, or 0 where a joint counts only by the centre of mass
    std::vector<double> order;  // c_ki of each pair of them
};

struct Pairs {
    std::vector<int> first, other;
    std::vector<int> motion_of;  // (frames, frames); -1: not used
    std::vector<RelativeMotion> motions;
    int frames = 0;
    int motion(int moved, int seen_from) const { return motion_of[moved * frames + seen_from]; }
};

// All of them, with what follows: where the bounds of a body are kept, one place for each motion of its frame.
struct Tables {
    Joints joints;
    Bodies bodies;
    Pairs pairs;
    std::vector<int> first_slot;  // by body; -1: of the scene
    int slots = 0;

    void index() {
        std::vector<int> motions(pairs.frames, 0);
        for (RelativeMotion& motion : pairs.motions) motion.rank = motions[motion.moved]++;
        for (const Body& body : bodies.list) {
            first_slot.push_back(body.frame == world ? -1 : slots);
            if (body.frame != world) slots += motions[body.frame];
        }
    }
};

// What pairs are held to; see `claim.HeldClearances`. Arrays belong to the caller.
struct Held {
    const double* required;              // (links, bodies)
    const std::int64_t* phase;           // (links, bodies)
    const std::int64_t* near;            // (links, bodies) 1 + the number of the pair that is near at an end, or 0
    const double *held, *until, *since;  // (k, 3), (k), (k) of those pairs
    const double* known_excess;          // (phases) what is known of the least excess; infinite: nothing
    const double* share;                 // (phases) times the least excess: how much of it is to be proven
    int bodies, phases;

    struct At {
        double clearance;
        int phase;
    };
    // On a stretch from begin to end, where the greater of two requirements counts.
    At on(int link, int body, double begin, double end) const {
        const std::size_t at = static_cast<std::size_t>(link) * bodies + body;
        const int pair = static_cast<int>(near[at]) - 1;
        if (pair < 0) return {required[at], static_cast<int>(phase[at])};
        const int part = end <= until[pair] ? 0 : begin >= since[pair] ? 1 : 2;
        return {held[3 * pair + part], 3 * pair + part + 1};
    }
};

}  // namespace spacearm_proof
