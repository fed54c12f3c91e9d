// How far a tracking error lets bodies get: each joint may be off its path by so much at every instant.
//
// A body that joints move in the frame of another one gets no further than `at_most`, and along a direction no further
// than `along` and a second order. docs/certificate.md, "Tracking error", has the proofs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "proof/bodies.hpp"

namespace spacearm_proof {

class Tube {
  public:
    // tracking (n): by degree of freedom. Of a floating base there is none.
    Tube(const Tables& tables, const double* tracking) : tables_(tables) {
        const Joints& joints = tables.joints;
        for (int k = 0; k < joints.count; ++k) {
            error_.push_back(tracking[joints.dof[k]] * std::abs(joints.multiplier[k]));
            any_ = any_ || error_[k] > 0;
        }
        for (const RelativeMotion& motion : tables.pairs.motions) motions_.push_back(of_motion(motion));
    }

    bool any() const { return any_; }
    double error(int joint) const { return error_[joint]; }

    // Along n, to first order. The centre c moves by n . (z x (c - o)) per radian of a joint, and an offset from it by
    // its length at most. frames: of the joints.
    double along(const Frame* frames, Vec3 c, int body, int m, Vec3 n) const {
        if (!any_) return 0;
        const RelativeMotion& of = tables_.pairs.motions[m];
        double out = tables_.bodies[body].reach * motions_[m].rotation;
        for (std::size_t i = 0; i < of.joints.size(); ++i) {
            const int k = of.joints[i];
            const Vec3 z = frames[k].axis(2);
            const double moved = tables_.joints.revolute[k] ? dot(cross(n, z), c - frames[k].origin()) : dot(n, z);
            out += motions_[m].first[i] * std::abs(moved);
        }
        return out;
    }

    // In any direction.
    double at_most(const Frame* frames, Vec3 c, int body, int m) const {
        if (!any_) return 0;
        return levers(frames, c, m, motions_[m].first) + tables_.bodies[body].reach * motions_[m].rotation;
    }

    // Along n, with the second order: a proof on a stretch, however short, loses at least this.
    double lost(const Frame* frames, Vec3 c, int body, int m, Vec3 n) const {
        if (!any_) return 0;
        const Motion& motion = motions_[m];
        const double reach = tables_.bodies[body].reach, first = levers(frames, c, m, motion.first);
        const double second = levers(frames, c, m, motion.second) + (first + reach) * motion.bend;
        return std::min(first + reach * motion.rotation, second + along(frames, c, body, m, n));
    }

  private:
    // tau_k and g_k of it, by joint of a motion, and their sums over the revolute joints.
    struct Motion {
        double rotation = 0, bend = 0;
        std::vector<double> first, second;
    };

    Motion of_motion(const RelativeMotion& of) const {
        const std::size_t count = of.joints.size();
        Motion out;
        for (std::size_t i = 0; i < count; ++i) {
            const double error = error_[of.joints[i]];
            double pairs = 0;
            for (std::size_t l = 0; l < count; ++l) pairs += of.order[i * count + l] * error_[of.joints[l]];
            out.first.push_back(error);
            out.second.push_back(pairs * error / 2);
            if (!tables_.joints.revolute[of.joints[i]]) continue;
            out.rotation += error;
            out.bend += pairs * error / 2;
        }
        return out;
    }

    // The sum of weights times the distances of c from the joints' axes.
    double levers(const Frame* frames, Vec3 c, int m, const std::vector<double>& weights) const {
        const RelativeMotion& of = tables_.pairs.motions[m];
        double out = 0;
        for (std::size_t i = 0; i < of.joints.size(); ++i) {
            const int k = of.joints[i];
            const bool turns = tables_.joints.revolute[k];
            out += weights[i] * (turns ? length(cross(frames[k].axis(2), c - frames[k].origin())) : 1.0);
        }
        return out;
    }

    const Tables& tables_;
    bool any_ = false;
    std::vector<double> error_;    // by joint
    std::vector<Motion> motions_;  // by motion
};

}  // namespace spacearm_proof
