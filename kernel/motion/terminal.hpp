// Terminal constraints of a motion on a base that moves: the pose of a frame of the robot in space, and the attitude of
// the base.
//
// Both depend on the whole motion, not on the last configuration alone. `terminal_solver` projects a motion onto them:
// it moves the control points as little as possible until both are met. It takes Gauss-Newton steps of least norm; the
// derivatives are differences, and are used again while the steps succeed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "geometry/vectors.hpp"

namespace SPACEARM_NAMESPACE {

enum class frame_goal : std::uint8_t { none, position, axis, pose };

struct terminal_constraints {
    static constexpr double lever = 0.2;  // [m]: an error of 1 rad of the frame counts as much as one of `lever` metres
    frame_goal kind = frame_goal::none;
    int joint = 0;                // that carries the frame
    rotation3 local{};            // the frame's axes ...
    double offset[3] = {};        // ... and origin, in the joint's frame
    rotation3 wanted{};           // its axes ...
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

// What is missing at the end, `count()` numbers: of the frame [m] and lever times [rad], of the base [rad]. `beyond` is
// the sum of what lies beyond the tolerances; `largest` is the largest part of `missing`, over its tolerance.
struct terminal_residual {
    double missing[9] = {};
    double beyond = 0, largest = 0;
};

// Where things are at the end of a motion: the joint that carries the goal's frame in the frame of the base, and the
// base in its frame at the beginning.
struct motion_end {
    rotation3 joint{}, base{};
    double joint_origin[3] = {}, base_origin[3] = {};
    quaternion attitude;  // the base's, more exactly
};

// The shortest rotation vector that takes the direction `is` to the direction `to`.
inline void shortest_rotation(const double* is, const double* to, double* turn) {
    const double across[3] = {is[1] * to[2] - is[2] * to[1], is[2] * to[0] - is[0] * to[2],
                              is[0] * to[1] - is[1] * to[0]};
    const double sine = std::sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
    const double angle = angle_of(sine, is[0] * to[0] + is[1] * to[1] + is[2] * to[2]);
    for (int i = 0; i < 3; ++i) turn[i] = sine > 1e-12 ? across[i] / sine * angle : 0;
    if (sine <= 1e-12 && angle > 1) {  // opposite: half a turn about any axis at right angles
        const int least = std::abs(is[0]) < 0.6 ? 0 : 1;
        const double other[3] = {least == 0 ? 1.0 : 0.0, least == 1 ? 1.0 : 0.0, 0.0};
        for (int i = 0; i < 3; ++i)
            turn[i] = is[(i + 1) % 3] * other[(i + 2) % 3] - is[(i + 2) % 3] * other[(i + 1) % 3];
        const double length = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
        for (int i = 0; i < 3; ++i) turn[i] *= angle / length;
    }
}

inline terminal_residual residual_of(const terminal_constraints& asked, const motion_end& end) {
    terminal_residual out;
    double* next = out.missing;
    const auto note = [&](double size, double tolerance, double weight) {
        const double share = size / std::max(tolerance, 1e-12);
        out.beyond += size <= tolerance ? 0.0 : weight * (size - tolerance);  // a NaN is missing
        if (!(share <= out.largest)) out.largest = share;
    };
    const auto norm = [](const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
    if (asked.kind != frame_goal::none) {
        rotation3 in_base, at;
        double local[3], point[3];
        for (int k = 0; k < 3; ++k) {
            rotated(end.joint, asked.local.c[k], in_base.c[k]);
            rotated(end.base, in_base.c[k], at.c[k]);
        }
        rotated(end.joint, asked.offset, local);
        for (int i = 0; i < 3; ++i) local[i] += end.joint_origin[i];
        rotated(end.base, local, point);
        double squared = 0;
        for (int i = 0; i < 3; ++i) {
            next[i] = asked.position[i] - (point[i] + end.base_origin[i]);
            squared += next[i] * next[i];
        }
        note(std::sqrt(squared), asked.near, 1);
        next += 3;
        double turn[3] = {0, 0, 0};
        if (asked.kind == frame_goal::pose) {
            rotation_vector(quaternion_of(asked.wanted) * conjugate(quaternion_of(at)), turn);
        } else if (asked.kind == frame_goal::axis) {
            double is[3], to[3];
            rotated(at, asked.axis, is);
            rotated(asked.wanted, asked.axis, to);
            shortest_rotation(is, to, turn);
        }
        if (asked.kind != frame_goal::position) {
            for (int i = 0; i < 3; ++i) next[i] = asked.lever * turn[i];
            note(norm(turn), asked.turned, asked.lever);
            next += 3;
        }
    }
    if (asked.base) {
        rotation_vector(conjugate(end.attitude) * asked.attitude, next);
        double size = norm(next);
        if (asked.base_within) {  // what is missing to a point a little inside the tolerance
            const double share = size > asked.base_turned ? 1 - 0.8 * asked.base_turned / size : 0;
            for (int i = 0; i < 3; ++i) next[i] *= share;
            size = share > 0 ? size : 0;
        }
        note(size, asked.base_turned, 1);
    }
    return out;
}

// Moves the numbers x of a motion, within bounds, until the constraints are met. `look(x, roughly)` gives the residual
// of numbers x; for slopes a rougher one will do.
template <class T> class terminal_solver {
  public:
    // good: how much of the tolerances may be missing. True when that is met. go_on() is asked before every round,
    // which takes a look for each number at most.
    template <class Look, class GoOn>
    bool solve(std::vector<T>& x, const std::vector<T>& lower, const std::vector<T>& upper, int count, double good,
               Look&& look, GoOn&& go_on) {
        const int D = static_cast<int>(x.size());
        if (static_cast<int>(slopes_.size()) != D * count) fresh_ = false;
        slopes_.resize(static_cast<std::size_t>(D) * count);
        terminal_residual now = look(x, false);
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
            const terminal_residual then = look(tried, false);
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
        const terminal_residual now = look(x, true);
        const T reach = sizeof(T) == 4 ? T(4e-3) : T(1e-6);
        for (std::size_t d = 0; d < x.size(); ++d) {
            const T before = x[d], move = before + reach <= upper[d] || before - reach < lower[d] ? reach : -reach;
            x[d] = before + move;
            const double moved = double(x[d]) - double(before);
            const terminal_residual there = look(x, true);
            x[d] = before;
            for (int i = 0; i < count; ++i) slopes_[d * count + i] = (now.missing[i] - there.missing[i]) / moved;
        }
        fresh_ = true;
    }
    void step(std::vector<T>& x, const std::vector<T>& lower, const std::vector<T>& upper, int count,
              const terminal_residual& now, double of_step) const {
        const int D = static_cast<int>(x.size());
        std::vector<char> at_bound(D, 0);
        std::vector<double> move(D);
        for (int pass = 0; pass < 3; ++pass) {
            double A[9][10] = {}, trace = 0;
            for (int d = 0; d < D; ++d) {
                if (at_bound[d]) continue;
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
                if (at_bound[d]) continue;
                for (int i = 0; i < count; ++i) move[d] += slopes_[d * count + i] * (A[i][count] / A[i][i]);
                longest = std::max(longest, std::abs(move[d]));
            }
            const double share = of_step * (longest > longest_step ? longest_step / longest : 1.0);
            for (int d = 0; d < D; ++d) {
                move[d] *= share;
                const bool out = (x[d] >= upper[d] && move[d] > 0) || (x[d] <= lower[d] && move[d] < 0);
                if (out && !at_bound[d]) at_bound[d] = again = true;
            }
            if (!again) break;
        }
        for (int d = 0; d < D; ++d) x[d] = std::clamp(static_cast<T>(x[d] + move[d]), lower[d], upper[d]);
    }

    std::vector<double> slopes_;  // (D, count): how much less is missing
    bool fresh_ = false;
};

}  // namespace SPACEARM_NAMESPACE
