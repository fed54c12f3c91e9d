// Where bodies are at the midpoint of a stretch, and how far they get from there on it.
//
// D1 and D2 bound the displacement of a body's points, to first and to second order; docs/certificate.md, section 3,
// has the proofs. They are computed when they are first asked for, once for each body, motion and stretch.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "lanes/trig.hpp"
#include "proof/bodies.hpp"
#include "proof/floating_base.hpp"
#include "proof/nearest_points.hpp"
#include "proof/path_tree.hpp"
#include "proof/tube.hpp"

namespace spacearm_proof {

// How a frame moves in another one on a stretch.
struct FrameMotion {
    int stamp = 0;
    Vec3 omega, push;                   // the twist at the midpoint, in inertial axes, per unit of u: omega x x + push
    double rotation, rotation_second;   // Theta and Theta2 of the joints between
    double bend;                        // the sum of g_k over the revolute joints
    std::vector<double> first, second;  // delta_k, and e_k + g_k, by joint of the motion
};

struct BodyMotion {
    int stamp = 0;
    double first, second;  // D1, D2; what a tracking error adds to D2 along a direction is the tube's to say
};

class MotionBounds {
  public:
    // tracking (n): by how much each joint may be off the path. start: the base's frame. floating: where it goes, or
    // nullptr for a base at rest.
    MotionBounds(const Tables& tables, Path& path, const double* tracking, const Frame& start,
                 const FloatingBase* floating)
        : tables_(tables), path_(path), tube_(tables, tracking), start_(start), floating_(floating),
          frames_(tables.joints.count + first_joint, identity()), q_(path.dofs()), line_rate_(path.dofs()),
          line_deviation_(path.dofs()), value_(tables.joints.count), rate_(tables.joints.count),
          deviation_(tables.joints.count), step_(tables.joints.count), motion_(tables.pairs.motions.size()),
          bounds_(tables.slots), placed_(tables.bodies.count(), 0), centers_(tables.bodies.count()),
          vertices_(tables.bodies.vertices.size()), axes_(tables.bodies.count()) {
        for (int b = 0; b < tables.bodies.count(); ++b) {
            centers_[b] = tables.bodies[b].center;
            axes_[b] = tables.bodies[b].axis;
        }
    }

    // Be at one instant; no bounds.
    void place(double u) {
        path_.sample(u, q_.data());
        place_at(u);
    }

    // Be on a stretch.
    void begin(const Stretch& stretch) {
        const Joints& joints = tables_.joints;
        half_ = path_.half(stretch);
        path_.linear_bounds(stretch, q_.data(), line_rate_.data(), line_deviation_.data());
        place_at(stretch.middle());
        for (int k = 0; k < joints.count; ++k) {
            const int dof = joints.dof[k];
            rate_[k] = line_rate_[dof] * joints.multiplier[k];
            deviation_[k] =
                line_deviation_[dof] * std::abs(joints.multiplier[k]) + value_rounding * std::abs(value_[k]);
            step_[k] = std::abs(rate_[k]) * half_ + deviation_[k] + tube_.error(k);
        }
        if (floating_)
            floating_->bounds(frames_[first_joint].T, frames_[base_frame].T, rate_.data(), deviation_.data(),
                              step_.data(), half_, base_);
    }

    bool floating() const { return floating_ != nullptr; }
    double half() const { return half_; }
    const Frame& frame(int f) const { return frames_[f]; }

    Vec3 center(int body) {
        place_body(body);
        return centers_[body];
    }

    PlacedBody placed(int body) {
        const Body& of = tables_.bodies[body];
        place_body(body);
        const double* points = of.frame == world ? tables_.bodies.vertices.data() : vertices_.data();
        const Vec3 axis = axes_[body];
        return {points + 3 * of.first_point, of.points, of.disc, {axis.x, axis.y, axis.z}, of.radius, of.half_space};
    }

    const FrameMotion& motion(int m) {
        FrameMotion& out = motion_[m];
        if (out.stamp != stamp_) bound_motion(tables_.pairs.motions[m], out);
        return out;
    }

    // Of one of the robot's bodies, in the frame that the motion m is seen from.
    const BodyMotion& bounds(int body, int m) {
        const RelativeMotion& relative = tables_.pairs.motions[m];
        BodyMotion& out = bounds_[tables_.first_slot[body] + relative.rank];
        if (out.stamp != stamp_) bound_body(body, relative, motion(m), out);
        return out;
    }

    // What the tracking error adds to D2 along n; and how far it alone lets a body get, in any direction or along n.
    double tube_along(int body, int m, Vec3 n) {
        return tube_.any() ? tube_.along(joint_frames(), center(body), body, m, n) : 0.0;
    }
    double tube_at_most(int body, int m) {
        return tube_.any() ? tube_.at_most(joint_frames(), center(body), body, m) : 0.0;
    }
    double lost_in_tube(int body, int m, Vec3 n) {
        return tube_.any() ? tube_.lost(joint_frames(), center(body), body, m, n) : 0.0;
    }

  private:
    const Frame* joint_frames() const { return frames_.data() + first_joint; }

    static constexpr double value_rounding = 1e-15;     // times a joint's value
    static constexpr double distance_rounding = 1e-14;  // times a squared distance, which is added to rho^2

    void place_at(double u) {
        const Joints& joints = tables_.joints;
        ++stamp_;
        Frame* of_joint = frames_.data() + first_joint;
        for (int k = 0; k < joints.count; ++k) {
            value_[k] = joints.multiplier[k] * q_[joints.dof[k]] + joints.offset[k];
            const int parent = joints.parent[k];
            const Frame& placement = joints.placement[k];
            of_joint[k] = parent >= 0 ? product(of_joint[parent], placement)
                          : floating_ ? placement
                                      : product(start_, placement);
            move_along(of_joint[k], joints.revolute[k], value_[k]);
        }
        if (!floating_) {
            frames_[base_frame] = start_;
            return;
        }
        floating_->place(u, of_joint->T, frames_[base_frame].T);
        for (int k = 0; k < joints.count; ++k) of_joint[k] = product(frames_[base_frame], of_joint[k]);
    }

    // Turn a frame about its z axis, or push it along.
    static void move_along(Frame& frame, bool revolute, double value) {
        if (!revolute) {
            for (int i = 0; i < 3; ++i) frame.T[4 * i + 3] += frame.T[4 * i + 2] * value;
            return;
        }
        double sine, cosine;
        SPACEARM_NAMESPACE::sincos(value, sine, cosine);
        for (int i = 0; i < 3; ++i) {
            double* row = frame.T + 4 * i;
            const double x = row[0], y = row[1];
            row[0] = x * cosine + y * sine;
            row[1] = y * cosine - x * sine;
        }
    }

    void place_body(int body) {
        const Body& of = tables_.bodies[body];
        if (of.frame == world || placed_[body] == stamp_) return;
        placed_[body] = stamp_;
        const Frame& frame = frames_[of.frame];
        centers_[body] = frame.placed(of.center);
        if (of.disc > 0) axes_[body] = frame.turned(of.axis);
        const double* from = tables_.bodies.vertices.data() + 3 * of.first_point;
        double* to = vertices_.data() + 3 * of.first_point;
        for (int i = 0; i < of.points; ++i, from += 3, to += 3) {
            const Vec3 x = frame.placed(vec3(from));
            to[0] = x.x, to[1] = x.y, to[2] = x.z;
        }
    }

    void bound_motion(const RelativeMotion& of, FrameMotion& out) {
        const Joints& joints = tables_.joints;
        const std::size_t count = of.joints.size();
        out.stamp = stamp_;
        out.first.resize(count);
        out.second.resize(count);
        out.omega = out.push = {0, 0, 0};
        out.rotation = out.rotation_second = out.bend = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const int k = of.joints[i];
            double pairs = 0;
            for (std::size_t l = 0; l < count; ++l) pairs += of.order[i * count + l] * step_[of.joints[l]];
            pairs *= step_[k] / 2;
            out.first[i] = step_[k];
            out.second[i] = deviation_[k] + pairs;
            const Vec3 z = frames_[first_joint + k].axis(2);
            const double rate = of.sign[i] * rate_[k];
            if (joints.revolute[k]) {
                out.bend += pairs;
                out.omega = out.omega + rate * z;
                out.push = out.push + rate * cross(frames_[first_joint + k].origin(), z);
                if (of.sign[i] != 0) {
                    out.rotation += step_[k];
                    out.rotation_second += out.second[i];
                }
            } else out.push = out.push + rate * z;
        }
        if (of.free) add_base_twist(of, out);
    }

    // The centre of mass rests but for its drift, and the base turns about it.
    void add_base_twist(const RelativeMotion& of, FrameMotion& out) const {
        const Vec3 com = vec3(base_.com), omega = vec3(base_.omega);
        Vec3 push = vec3(base_.com_velocity) - cross(omega, com);
        for (const int k : of.joints) {
            const Vec3 z = frames_[first_joint + k].axis(2);
            const Vec3 lever =
                tables_.joints.revolute[k] ? cross(z, vec3(&base_.com_lever[3 * k])) : base_.mass_share[k] * z;
            push = push - rate_[k] * lever;
        }
        out.omega = out.omega + omega;
        out.push = out.push + push;
    }

    void bound_body(int body, const RelativeMotion& of, const FrameMotion& motion, BodyMotion& out) {
        place_body(body);
        const Vec3 c = centers_[body];
        const double reach = tables_.bodies[body].reach;
        double first = 0, second = 0;
        for (std::size_t i = 0; i < of.joints.size(); ++i) {
            const double rho = lever(c, of, i);
            first += rho * motion.first[i];
            second += rho * motion.second[i];
        }
        out.second = second + first * motion.bend + reach * motion.rotation_second;
        out.first = first + reach * motion.rotation;
        if (of.free) {
            const double away = length(c - vec3(base_.com)) + reach, turn = base_.rotation;
            const double error = base_.attitude_error, moved = out.first + away * turn;
            out.second += turn * out.first + away * (turn * turn / 2 + base_.rotation_second_order + error);
            out.second += error * moved;
            out.first = moved + away * error + length(vec3(base_.com_velocity)) * half_;
        }
        out.stamp = stamp_;
    }

    // rho_k of the point c, rounded up.
    double lever(Vec3 c, const RelativeMotion& of, std::size_t i) const {
        const int k = of.joints[i];
        const Frame& frame = frames_[first_joint + k];
        if (!tables_.joints.revolute[k]) return of.free ? std::abs(of.sign[i] - base_.mass_share[k]) : 1.0;
        Vec3 away = c - frame.origin();
        if (of.free) away = of.sign[i] * away - vec3(&base_.com_lever[3 * k]);
        const double along = dot(away, frame.axis(2)), squared = dot(away, away);
        return std::sqrt(std::max(squared - along * along, 0.0) + distance_rounding * squared);
    }

    const Tables& tables_;
    Path& path_;
    Tube tube_;
    Frame start_;
    const FloatingBase* floating_;
    int stamp_ = 0;
    double half_ = 0;
    std::vector<Frame> frames_;
    std::vector<double> q_, line_rate_, line_deviation_, value_, rate_, deviation_, step_;
    BaseBounds base_{};
    std::vector<FrameMotion> motion_;
    std::vector<BodyMotion> bounds_;
    std::vector<int> placed_;
    std::vector<Vec3> centers_;
    std::vector<double> vertices_;
    std::vector<Vec3> axes_;
};

}  // namespace spacearm_proof
