// What is asked of a floating base's motion at its end: where a frame of the robot is in space, and how the base
// stands.
//
// Both depend on the whole motion, not on the last configuration alone. `end_solver` moves control points, as little as
// can be, until both are met: Gauss-Newton steps of least norm, derivatives by differences, used again while they
// serve.
#pragma once

#include "base.hpp"

namespace SPACEARM_NAMESPACE {

struct turn_matrix {
    double c[3][3];  // columns
};
// The rotation vector of a matrix.
inline void rotation_vector(const quaternion& given, double* out) {
    const double sign = given.w < 0 ? -1 : 1, s = std::sqrt(given.x * given.x + given.y * given.y + given.z * given.z);
    const double factor = s > 1e-12 ? sign * 2 * angle_of(s, sign * given.w) / s : 2 * sign;
    out[0] = given.x * factor;
    out[1] = given.y * factor;
    out[2] = given.z * factor;
}
inline quaternion quaternion_of(const turn_matrix& m) {
    const auto r = [&](int row, int column) { return m.c[column][row]; };
    quaternion q;
    const double trace = r(0, 0) + r(1, 1) + r(2, 2);
    if (trace > 0) q = {1 + trace, r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
    else if (r(0, 0) >= r(1, 1) && r(0, 0) >= r(2, 2))
        q = {r(2, 1) - r(1, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2), r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)};
    else if (r(1, 1) >= r(2, 2))
        q = {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), 1 + r(1, 1) - r(0, 0) - r(2, 2), r(1, 2) + r(2, 1)};
    else q = {r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), 1 + r(2, 2) - r(0, 0) - r(1, 1)};
    const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {q.w / length, q.x / length, q.y / length, q.z / length};
}

enum class frame_goal : std::uint8_t { none, position, axis, pose };

struct end_goals {
    static constexpr double lever = 0.2;  // [m]: an error of 1 rad of the frame weighs as one of so many metres
    frame_goal kind = frame_goal::none;
    int joint = 0;                // that carries the frame
    turn_matrix local{};          // the frame's axes ...
    double offset[3] = {};        // ... and origin, in the joint's frame
    turn_matrix wanted{};         // its axes ...
    double position[3] = {};      // ... and origin in space
    double axis[3] = {};          // the free axis, in the frame
    double near = 0, turned = 0;  // tolerances [m], [rad]
    bool base = false;
    quaternion attitude;       // of the base
    double base_turned = 0;    // its tolerance [rad]
    bool base_within = false;  // anywhere within the tolerance is as good

    int count() const { return (kind == frame_goal::none ? 0 : kind == frame_goal::position ? 3 : 6) + (base ? 3 : 0); }
    bool any() const { return count() > 0; }
};

// What is missing at the end, so many numbers: of the frame [m], lever times [rad], of the base [rad]; and how far that
// is beyond the tolerances, summed.
struct end_state {
    double missing[9] = {};
    double beyond = 0, largest = 0;  // largest: of what is missing, over its tolerance
};

template <class T> double last_lane(const pack<T>& p) {
    T lane[lanes_of<T>];
    p.store(lane);
    return lane[lanes_of<T> - 1];
}
template <class T> void last_lanes(const frame<T>& f, turn_matrix& axes, double* origin) {
    for (int k = 0; k < 3; ++k) {
        axes.c[k][0] = last_lane(f.column[k].x);
        axes.c[k][1] = last_lane(f.column[k].y);
        axes.c[k][2] = last_lane(f.column[k].z);
    }
    origin[0] = last_lane(f.origin.x);
    origin[1] = last_lane(f.origin.y);
    origin[2] = last_lane(f.origin.z);
}
inline void turned_by(const turn_matrix& m, const double* v, double* out) {
    for (int i = 0; i < 3; ++i) out[i] = m.c[0][i] * v[0] + m.c[1][i] * v[1] + m.c[2][i] * v[2];
}

template <class T> end_state end_of_track(const end_goals& goals, const base_track<T>& track) {
    end_state out;
    double* next = out.missing;
    const auto note = [&](double size, double tolerance, double weight) {
        const double of_it = size / std::max(tolerance, 1e-12);
        out.beyond += size <= tolerance ? 0.0 : weight * (size - tolerance);  // a NaN is missing
        if (!(of_it <= out.largest)) out.largest = of_it;
    };
    if (goals.kind != frame_goal::none) {
        const int l = track.packs() - 1;
        turn_matrix joint, base, in_base, at;
        double origin[3], base_origin[3], local[3], point[3];
        last_lanes(track.frames(l)[goals.joint], joint, origin);
        last_lanes(track.base(l), base, base_origin);
        for (int k = 0; k < 3; ++k) {
            turned_by(joint, goals.local.c[k], in_base.c[k]);
            turned_by(base, in_base.c[k], at.c[k]);
        }
        turned_by(joint, goals.offset, local);
        for (int i = 0; i < 3; ++i) local[i] += origin[i];
        turned_by(base, local, point);
        double squared = 0;
        for (int i = 0; i < 3; ++i) {
            next[i] = goals.position[i] - (point[i] + base_origin[i]);
            squared += next[i] * next[i];
        }
        note(std::sqrt(squared), goals.near, 1);
        next += 3;
        double turn[3] = {0, 0, 0};
        if (goals.kind == frame_goal::pose) {
            rotation_vector(quaternion_of(goals.wanted) * conjugate(quaternion_of(at)), turn);
        } else if (goals.kind
                   == frame_goal::axis) {  // the shortest turn from where the axis points to where it is to point
            double is[3], to[3];
            turned_by(at, goals.axis, is);
            turned_by(goals.wanted, goals.axis, to);
            const double across[3] = {is[1] * to[2] - is[2] * to[1], is[2] * to[0] - is[0] * to[2],
                                      is[0] * to[1] - is[1] * to[0]};
            const double sine = std::sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
            const double angle = angle_of(sine, is[0] * to[0] + is[1] * to[1] + is[2] * to[2]);
            for (int i = 0; i < 3; ++i) turn[i] = sine > 1e-12 ? across[i] / sine * angle : 0;
            if (sine <= 1e-12 && angle > 1) {  // opposite: half a turn about whatever is across
                const int least = std::abs(is[0]) < 0.6 ? 0 : 1;
                const double other[3] = {least == 0 ? 1.0 : 0.0, least == 1 ? 1.0 : 0.0, 0.0};
                for (int i = 0; i < 3; ++i)
                    turn[i] = is[(i + 1) % 3] * other[(i + 2) % 3] - is[(i + 2) % 3] * other[(i + 1) % 3];
                const double length = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
                for (double& t : turn) t *= angle / length;
            }
        }
        if (goals.kind != frame_goal::position) {
            for (int i = 0; i < 3; ++i) next[i] = goals.lever * turn[i];
            note(std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]), goals.turned, goals.lever);
            next += 3;
        }
    }
    if (goals.base) {
        rotation_vector(conjugate(track.attitude(track.nodes())) * goals.attitude, next);
        double size = std::sqrt(next[0] * next[0] + next[1] * next[1] + next[2] * next[2]);
        if (goals.base_within) {  // what is missing to a little inside
            const double share = size > goals.base_turned ? 1 - 0.8 * goals.base_turned / size : 0;
            for (int i = 0; i < 3; ++i) next[i] *= share;
            size = share > 0 ? size : 0;
        }
        note(size, goals.base_turned, 1);
    }
    return out;
}

// Moves the numbers x of a motion, within bounds, until the ends are met. `look(x, roughly)` gives the end_state of
// numbers x; for slopes it may be a rougher one.
template <class T> class end_solver {
  public:
    // good: how much of the tolerances may be missing. True when that is met. go_on() is asked before every round,
    // which takes a look for each number at most.
    template <class Look, class GoOn>
    bool solve(std::vector<T>& x, const std::vector<T>& lower, const std::vector<T>& upper, int count, double good,
               Look&& look, GoOn&& go_on) {
        const int D = static_cast<int>(x.size());
        if (static_cast<int>(slopes_.size()) != D * count) fresh_ = false;
        slopes_.resize(static_cast<std::size_t>(D) * count);
        end_state now = look(x, false);
        std::vector<T> tried;
        double share = 1;   // of a step that went wrong with slopes from right here
        bool here = false;  // whether the slopes are from right here
        for (int round = 0; round < most_rounds; ++round) {
            if (now.largest <= good) return true;
            if (!go_on()) break;
            if (!fresh_) {
                differentiate(x, lower, upper, count, look);
                here = true;
            }
            tried = x;
            step(tried, lower, upper, count, now, share);
            const end_state then = look(tried, false);
            const bool better = then.largest < (here ? 1 - 0.1 * share : 0.5) * now.largest;
            if (better) {
                x.swap(tried);
                now = then;
                here = false;
                share = std::min(1.0, 2 * share);
            } else if (!here) {
                fresh_ = false;
            } else if ((share /= 4) < 0.01) {
                break;
            }
        }
        return now.largest <= good;
    }
    void forget() { fresh_ = false; }

  private:
    static constexpr int most_rounds = sizeof(T) == 4 ? 16 : 40;
    static constexpr double longest_step = 0.6;  // [rad or m] of any number

    template <class Look>
    void differentiate(std::vector<T>& x, const std::vector<T>& lower, const std::vector<T>& upper, int count,
                       Look&& look) {
        const end_state now = look(x, true);
        const T reach = sizeof(T) == 4 ? T(4e-3) : T(1e-6);
        for (std::size_t d = 0; d < x.size(); ++d) {
            const T before = x[d], way = before + reach <= upper[d] || before - reach < lower[d] ? reach : -reach;
            x[d] = before + way;
            const double moved = double(x[d]) - double(before);
            const end_state there = look(x, true);
            x[d] = before;
            for (int i = 0; i < count; ++i) slopes_[d * count + i] = (now.missing[i] - there.missing[i]) / moved;
        }
        fresh_ = true;
    }
    void step(std::vector<T>& x, const std::vector<T>& lower, const std::vector<T>& upper, int count,
              const end_state& now, double of_step) const {
        const int D = static_cast<int>(x.size());
        std::vector<char> held(D, 0);
        std::vector<double> move(D);
        for (int pass = 0; pass < 3; ++pass) {
            double A[9][10] = {}, trace = 0;
            for (int d = 0; d < D; ++d) {
                if (held[d]) continue;
                for (int i = 0; i < count; ++i) {
                    for (int k = 0; k < count; ++k) A[i][k] += slopes_[d * count + i] * slopes_[d * count + k];
                }
            }
            for (int i = 0; i < count; ++i) trace += A[i][i];
            for (int i = 0; i < count; ++i) {
                A[i][i] += (sizeof(T) == 4 ? 1e-7 : 1e-13) * trace + 1e-30;
                A[i][count] = now.missing[i];
            }
            for (int a = 0; a < count; ++a) {  // positive definite
                for (int b = 0; b < count; ++b) {
                    if (b == a) continue;
                    const double factor = A[b][a] / A[a][a];
                    for (int k = a; k <= count; ++k) A[b][k] -= factor * A[a][k];
                }
            }
            bool again = false;
            double longest = 0;
            for (int d = 0; d < D; ++d) {
                move[d] = 0;
                if (held[d]) continue;
                for (int i = 0; i < count; ++i) move[d] += slopes_[d * count + i] * (A[i][count] / A[i][i]);
                longest = std::max(longest, std::abs(move[d]));
            }
            const double share = of_step * (longest > longest_step ? longest_step / longest : 1.0);
            for (int d = 0; d < D; ++d) {
                move[d] *= share;
                const bool out = (x[d] >= upper[d] && move[d] > 0) || (x[d] <= lower[d] && move[d] < 0);
                if (out && !held[d]) held[d] = again = true;
            }
            if (!again) break;
        }
        for (int d = 0; d < D; ++d) x[d] = std::clamp(static_cast<T>(x[d] + move[d]), lower[d], upper[d]);
    }

    std::vector<double> slopes_;  // (D, count): how much less is missing
    bool fresh_ = false;
};

}  // namespace SPACEARM_NAMESPACE
