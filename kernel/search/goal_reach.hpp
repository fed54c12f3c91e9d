// Damped least squares onto a goal in space: a frame's error and its Jacobian, and steps of the joints, for packs of
// configurations, one a lane.
//
// Only the joints that move the frame are looked at. Each entry of q that drives some of them is a column of the
// Jacobian.
#pragma once

#include <vector>

#include "mechanism/world.hpp"
#include "motion/terminal.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct goal_reach {
    tree<T> chain;             // the joints that move the frame, from the base on; their dofs are columns
    std::vector<char> adds;    // of each of them: whether an earlier one has the same column
    std::vector<int> entries;  // of each column: the entry of q
    std::vector<char> slides;  // of each column: whether it drives slides alone
    frame_goal kind = frame_goal::position;
    T local[3] = {};                            // the frame's origin in the last joint's frame
    T position[3] = {};                         // where it is to be
    T columns[3][3] = {};                       // a pose: those of the last joint's frame, where the frame is as wanted
    T axis[3] = {}, pointed[3] = {};            // an axis: in the last joint's frame, and where it is to point
    T squared_distance = 0, squared_chord = 0;  // tolerances
    static constexpr T lever = static_cast<T>(terminal_constraints::lever);

    int width() const { return static_cast<int>(entries.size()); }
    int rows() const { return kind == frame_goal::position ? 3 : 6; }
};

// The model's joints carry the frame. Angles are measured by their chord, 2 sin(angle / 2).
template <class T> goal_reach<T> make_reach(const tree<T>& robot, const terminal_constraints& g) {
    require(g.kind != frame_goal::none, "no goal of a frame");
    require(g.joint >= 0 && g.joint < static_cast<int>(robot.joints.size()), "the goal's joint is out of range");
    bool sound = all_within(g.offset, widest) && all_within(g.position, widest) && all_within(g.axis, 2)
                 && within(g.near, widest) && within(g.turned, widest);
    for (int k = 0; k < 3; ++k) sound = sound && all_within(g.local.c[k], 2) && all_within(g.wanted.c[k], 2);
    require(sound, "a goal's number that is none, or too large");
    goal_reach<T> out;
    std::vector<int> path;
    for (int j = g.joint; j >= 0; j = robot.joints[j].parent) path.push_back(j);
    for (std::size_t k = path.size(); k-- > 0;) {
        tree_joint<T> joint = robot.joints[path[k]];
        const auto at = std::find(out.entries.begin(), out.entries.end(), joint.dof);
        out.adds.push_back(at != out.entries.end());
        joint.parent = static_cast<int>(out.chain.joints.size()) - 1;
        joint.dof = static_cast<int>(at - out.entries.begin());
        joint.needed = 7;
        if (at == out.entries.end()) {
            out.entries.push_back(robot.joints[path[k]].dof);
            out.slides.push_back(1);
        }
        if (joint.kind != joint_kind::prismatic) out.slides[joint.dof] = 0;
        out.chain.joints.push_back(joint);
    }
    out.chain.dofs = out.width();
    out.kind = g.kind;
    copy_numbers(g.offset, out.local);
    copy_numbers(g.position, out.position);
    for (int i = 0; i < 3; ++i) {
        double pointed = 0, axis = 0;
        for (int k = 0; k < 3; ++k) {
            double sum = 0;  // wanted, times the inverse of local
            for (int l = 0; l < 3; ++l) sum += g.wanted.c[l][i] * g.local.c[l][k];
            out.columns[k][i] = static_cast<T>(sum);
            pointed += g.wanted.c[k][i] * g.axis[k];
            axis += g.local.c[k][i] * g.axis[k];
        }
        out.pointed[i] = static_cast<T>(pointed);
        out.axis[i] = static_cast<T>(axis);
    }
    out.squared_distance = static_cast<T>(g.near * g.near);
    constexpr double half_turn = 3.14159265358979323846;
    double s, c;
    sincos(std::min(g.turned, half_turn) / 2, s, c);
    out.squared_chord = g.turned >= half_turn ? T(5) : static_cast<T>(4 * s * s);  // no chord is longer than 2
    return out;
}

// Of one pack of configurations.
template <class T> struct reach_memory {
    std::vector<frame<T>> frames;   // of the chain's joints
    std::vector<pack<T>> jacobian;  // six numbers a column: [m] a unit of q, turns times the lever
    std::vector<pack<T>> held;      // likewise, none of columns that may not move
    std::vector<pack<T>> step;      // a number a column
    pack<T> missing[6];             // the error: what is missing to the goal [m], turns times the lever
    pack<T> distance, chord;        // squared
    pack<T> cost;                   // the square of what is missing
    explicit reach_memory(const goal_reach<T>& r)
        : frames(r.chain.joints.size()), jacobian(6 * r.entries.size()), held(6 * r.entries.size()),
          step(r.entries.size()) {}
};

template <class T> SPACEARM_INLINE void put_column(pack<T>* to, const vec3<T>& moves, const vec3<T>& turns, bool add) {
    const pack<T> numbers[6] = {moves.x, moves.y, moves.z, turns.x, turns.y, turns.z};
    for (int i = 0; i < 6; ++i) to[i] = add ? to[i] + numbers[i] : numbers[i];
}

// The error and its Jacobian at q, a pack a column.
template <class T> SPACEARM_NOINLINE void evaluate_goal(const goal_reach<T>& r, const pack<T>* q, reach_memory<T>& m) {
    forward_kinematics(r.chain, q, m.frames.data());
    const frame<T>& last = m.frames.back();
    const vec3<T> at = carry(last, r.local);
    const vec3<T> left = constant(r.position) - at;
    m.missing[0] = left.x;
    m.missing[1] = left.y;
    m.missing[2] = left.z;
    m.distance = dot(left, left);
    m.chord = pack<T>(T(0));
    m.cost = m.distance;
    vec3<T> free{pack<T>(T(0)), pack<T>(T(0)), pack<T>(T(0))};
    if (r.kind != frame_goal::position) {
        vec3<T> across;  // the axis of the turn that is missing, as long as its sine
        pack<T> along;   // its cosine
        if (r.kind == frame_goal::axis) {
            free = rotate(last, r.axis);
            across = cross(free, constant(r.pointed));
            along = dot(free, r.pointed);
        } else {
            across = cross(last.column[0], constant(r.columns[0])) + cross(last.column[1], constant(r.columns[1]))
                     + cross(last.column[2], constant(r.columns[2]));
            across = scaled(across, pack<T>(T(0.5)));
            along = (dot(last.column[0], r.columns[0]) + dot(last.column[1], r.columns[1])
                     + dot(last.column[2], r.columns[2]) - T(1))
                    * T(0.5);
        }
        // The chord, sqrt(2 - 2 cos), is the sine times this factor; near a half turn, where the sine vanishes, less.
        const pack<T> factor = sqrt(pack<T>(T(2)) / max(along + T(1), pack<T>(T(1e-6))));
        const vec3<T> turn = scaled(across, factor);
        m.chord = select(along < T(0), pack<T>(T(2)) - (along + along), dot(turn, turn));
        m.missing[3] = turn.x * r.lever;
        m.missing[4] = turn.y * r.lever;
        m.missing[5] = turn.z * r.lever;
        m.cost = m.distance + m.chord * (r.lever * r.lever);
    }
    for (std::size_t k = 0; k < r.chain.joints.size(); ++k) {
        const tree_joint<T>& joint = r.chain.joints[k];
        const vec3<T> z = scaled(m.frames[k].column[2], pack<T>(joint.multiplier));
        pack<T>* to = &m.jacobian[6 * joint.dof];
        const pack<T> zero(T(0));
        if (joint.kind == joint_kind::prismatic) {
            put_column(to, z, vec3<T>{zero, zero, zero}, r.adds[k]);
            continue;
        }
        vec3<T> turns = scaled(z, pack<T>(r.lever));
        if (r.kind == frame_goal::axis) {  // turning about the free axis changes nothing
            const pack<T> lost = dot(free, turns);
            turns = turns - scaled(free, lost);
        }
        put_column(to, cross(z, at - m.frames[k].origin), turns, r.adds[k]);
    }
}

template <class T> SPACEARM_INLINE pack_mask<T> is_reached(const goal_reach<T>& r, const reach_memory<T>& m) {
    return (m.distance <= r.squared_distance) & (m.chord <= r.squared_chord);
}

// Solves (J J^T + damping I) y = wanted and returns J^T y: M rows, columns of six numbers.
template <int M, class T>
SPACEARM_NOINLINE void damped_least_squares(const pack<T>* J, int width, const pack<T>* wanted, const pack<T>& damping,
                                            pack<T>* out) {
    constexpr T rounding = 64 * std::numeric_limits<T>::epsilon();
    pack<T> A[M][M], L[M][M], D[M], inverse[M], y[M];
    for (int i = 0; i < M; ++i) {
        for (int j = 0; j <= i; ++j) A[i][j] = pack<T>(T(0));
    }
    for (int c = 0; c < width; ++c) {
        const pack<T>* column = J + 6 * c;
        for (int i = 0; i < M; ++i) {
            for (int j = 0; j <= i; ++j) A[i][j] += column[i] * column[j];
        }
    }
    pack<T> trace = A[0][0];
    for (int i = 1; i < M; ++i) trace += A[i][i];
    const pack<T> added = damping + trace * rounding + T(1e-14);  // never singular, whatever the arm's size
    for (int j = 0; j < M; ++j) {
        pack<T> v[M], d = A[j][j] + added;
        for (int k = 0; k < j; ++k) {
            v[k] = L[j][k] * D[k];
            d -= L[j][k] * v[k];
        }
        D[j] = max(d, added * T(0.5));
        inverse[j] = pack<T>(T(1)) / D[j];
        for (int i = j + 1; i < M; ++i) {
            pack<T> sum = A[i][j];
            for (int k = 0; k < j; ++k) sum -= L[i][k] * v[k];
            L[i][j] = sum * inverse[j];
        }
    }
    for (int i = 0; i < M; ++i) {
        y[i] = wanted[i];
        for (int k = 0; k < i; ++k) y[i] -= L[i][k] * y[k];
    }
    for (int i = M - 1; i >= 0; --i) {
        y[i] = y[i] * inverse[i];
        for (int k = i + 1; k < M; ++k) y[i] -= L[k][i] * y[k];
    }
    for (int c = 0; c < width; ++c) {
        pack<T> sum = J[6 * c] * y[0];
        for (int i = 1; i < M; ++i) sum += J[6 * c + i] * y[i];
        out[c] = sum;
    }
}
template <class T>
SPACEARM_INLINE void damped_least_squares(const goal_reach<T>& r, const pack<T>* J, const pack<T>* wanted,
                                          const pack<T>& damping, pack<T>* out) {
    if (r.rows() == 3) damped_least_squares<3>(J, r.width(), wanted, damping, out);
    else damped_least_squares<6>(J, r.width(), wanted, damping, out);
}

inline constexpr double longest_step = 0.6;   // [rad or m] of any joint: the Jacobian tells little farther away
inline constexpr double longest_slide = 0.1;  // of a slide, this share of what is between its bounds, if that is more
inline constexpr double converged = 1e-10;    // [m] error that is called none: rounding is 1e-15 or so
inline constexpr double damping_share = 0.1;  // of the error's square [m^2] is what a step is damped by

// most: the greatest entry, as far as it counts.
template <class T> SPACEARM_INLINE void limit_step_by(pack<T>* step, int width, const pack<T>& most) {
    const pack<T> factor = min(pack<T>(T(1)), pack<T>(T(longest_step)) / most);
    for (int c = 0; c < width; ++c) step[c] = step[c] * factor;
}
template <class T> SPACEARM_INLINE void limit_step(pack<T>* step, int width) {
    pack<T> most(T(1e-30));
    for (int c = 0; c < width; ++c) most = max(most, abs(step[c]));
    limit_step_by(step, width, most);
}

// Moves q a step of damped least squares, from where the goal was looked at: damped by the error itself, so that steps
// near the goal converge quadratically (Sugihara, 2011). Joints that push against a bound stay on it.
template <class T>
SPACEARM_NOINLINE void damped_step(const goal_reach<T>& r, reach_memory<T>& m, const pack<T>* q, const T* lower,
                                   const T* upper, const pack<T>& share, pack<T>* to) {
    const pack<T> damping = m.cost * share;
    pack<T>* step = m.step.data();
    damped_least_squares(r, m.jacobian.data(), m.missing, damping, step);
    const pack<T> zero(T(0)), one(T(1));
    bool held = false;
    for (int c = 0; c < r.width(); ++c) {
        const pack_mask<T> against =
            ((q[c] <= lower[c]) & (step[c] < T(0))) | ((pack<T>(upper[c]) <= q[c]) & (zero < step[c]));
        held = held || any(against);
        const pack<T> free = select(against, zero, one);
        for (int i = 0; i < 6; ++i) m.held[6 * c + i] = m.jacobian[6 * c + i] * free;
    }
    if (held) damped_least_squares(r, m.held.data(), m.missing, damping, step);
    pack<T> most(T(1e-30));
    for (int c = 0; c < r.width(); ++c) {
        const T all = r.slides[c] ? T(longest_slide) * (upper[c] - lower[c]) : T(0);
        most = max(most, all > T(longest_step) ? abs(step[c]) * (T(longest_step) / all) : abs(step[c]));
    }
    limit_step_by(step, r.width(), most);
    for (int c = 0; c < r.width(); ++c) to[c] = clamp(q[c] + step[c], pack<T>(lower[c]), pack<T>(upper[c]));
}

// Brings packs within the bounds to the goal's centre, or as near to it as bounds and arm allow (Levenberg and
// Marquardt: the damping falls with each step that comes nearer, and rises with each that does not, which is not
// taken).
template <class T>
void polish(const goal_reach<T>& r, reach_memory<T>& m, pack<T>* q, const T* lower, const T* upper, int rounds) {
    std::vector<pack<T>> tried(r.width());
    pack<T> share(static_cast<T>(damping_share / 100));
    evaluate_goal(r, q, m);
    pack<T> cost = m.cost;
    for (int round = 0; round < rounds && !all(cost <= static_cast<T>(converged * converged)); ++round) {
        damped_step(r, m, q, lower, upper, share, tried.data());
        evaluate_goal(r, tried.data(), m);
        const pack_mask<T> better = m.cost < cost;
        cost = select(better, m.cost, cost);
        for (int c = 0; c < r.width(); ++c) q[c] = select(better, tried[c], q[c]);
        share = clamp(share * select(better, pack<T>(T(0.1)), pack<T>(T(8))), pack<T>(T(1e-12)), pack<T>(T(1e12)));
        if (!all(better)) evaluate_goal(r, q, m);
    }
}

}  // namespace SPACEARM_NAMESPACE
