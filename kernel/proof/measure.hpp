// The least clearance of every link and every other body at instants: measured, not proven.
//
// Pairs of outermost bodies are opened as far as the balls around them do not settle them: a bundle is replaced by its
// members, and two shapes are measured. What is more than asked for, or more than is known of the same link and the
// same other body, is not measured.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "proof/bodies.hpp"
#include "proof/motion_bounds.hpp"
#include "proof/nearest_points.hpp"
#include "proof/path_tree.hpp"

namespace spacearm_proof {

// Clearances of the pairs that tables name, along a path. Columns are the other bodies: obstacles first, then links.
class Clearances {
  public:
    // The tables, the path's arrays and the base are not copied. tracking (n): see MotionBounds.
    Clearances(const Tables& tables, const PathInput& path, const double* tracking, const Frame& start,
               const FloatingBase* floating)
        : tables_(tables), bodies_(tables.bodies), path_(path), motion_(tables_, path_, tracking, start, floating) {}
    Clearances(const Clearances&) = delete;
    Clearances& operator=(const Clearances&) = delete;

    int count() const { return bodies_.count(); }

    // Throws if there are fewer links or obstacles than the bodies name.
    void require_owners(std::size_t links, std::size_t obstacles) const {
        for (const Body& body : bodies_.list)
            if (body.owner >= static_cast<int>(body.frame == world ? obstacles : links))
                throw std::invalid_argument("clearances: the limits are not those of the bodies");
    }

    // Look for clearances below limits (links, obstacles + links); pairs with minus infinity are left out. in_tube:
    // what the tracking error may take is taken from them.
    void begin(int links, int obstacles, const double* limit, bool in_tube) {
        in_tube_ = in_tube;
        columns_ = obstacles + links, obstacles_ = obstacles;
        const std::size_t count = bodies_.count();
        limit_.resize(links * count);
        for (int link = 0; link < links; ++link) {
            double* of_body = limit_.data() + link * count;
            for (std::size_t i = 0; i < count; ++i) {
                const Body& body = bodies_[static_cast<int>(i)];
                const double* first = of_body + body.first_member;
                of_body[i] = body.owner >= 0 ? limit[link * columns_ + column(body)]
                                             : *std::max_element(first, first + body.members);
            }
        }
    }

    // Lower `least` (links, obstacles + links) to what pairs have at u, for two links in the row of the one that comes
    // first; all its values are to be at most the limits. which: (links, obstacles + links, 2) the two shapes.
    void least(double u, double* least, std::int64_t* which) {
        motion_.place(u);
        least_ = least, which_ = which;
        const Pairs& pairs = tables_.pairs;
        for (std::size_t i = 0; i < pairs.first.size(); ++i) open(pairs.first[i], pairs.other[i]);
    }

    // The clearance of two shapes at u; in the tube what the tracking error may take is taken from it.
    double between(double u, int first, int other, bool in_tube) {
        motion_.place(u);
        return in_tube ? clearance_in_tube(first, other) : clearance(first, other);
    }

  private:
    const Tables& tables_;
    const Bodies& bodies_;
    Path path_;
    MotionBounds motion_;
    std::vector<double> limit_;  // by link and body: of a bundle of several obstacles the greatest of its members
    double* least_ = nullptr;
    std::int64_t* which_ = nullptr;
    int columns_ = 0, obstacles_ = 0;
    bool in_tube_ = false;

    int column(const Body& body) const { return body.frame == world ? body.owner : obstacles_ + body.owner; }

    std::size_t place_of(const Body& first, const Body& other) const {
        int row = first.owner, of = column(other);
        if (other.frame != world && other.owner < row) row = other.owner, of = obstacles_ + first.owner;
        return static_cast<std::size_t>(row) * columns_ + of;
    }

    double clearance(int first, int other) {
        return nearest_points(motion_.placed(first), motion_.placed(other)).clearance;
    }
    double clearance_in_tube(int first, int other) {
        const Nearest near = nearest_points(motion_.placed(first), motion_.placed(other));
        return near.clearance - motion_.lost_in_tube(first, motion_of(first, other), vec3(near.n));
    }
    int motion_of(int first, int other) const {
        return tables_.pairs.motion(bodies_[first].frame, bodies_[other].frame);
    }

    // Whether the balls around two bodies are further apart than `enough`.
    bool far(int first, int other, double enough) {
        const Body &a = bodies_[first], &b = bodies_[other];
        const double own = a.reach + a.radius;
        if (b.half_space) return dot(b.axis, motion_.center(first) - motion_.center(other)) - own > enough;
        const Vec3 to = motion_.center(first) - motion_.center(other);
        const double all = enough + own + b.reach + b.radius;
        return all < 0.0 || dot(to, to) > all * all;
    }

    void open(int first, int other) {
        const Body &a = bodies_[first], &b = bodies_[other];
        double enough = limit_[static_cast<std::size_t>(a.owner) * bodies_.count() + other];
        if (b.owner >= 0) enough = std::min(enough, least_[place_of(a, b)]);
        if (!(enough > -std::numeric_limits<double>::infinity())) return;
        if (far(first, other, in_tube_ ? enough + motion_.tube_at_most(first, motion_of(first, other)) : enough))
            return;
        if (a.members > 0 && (b.members == 0 || a.radius > b.radius)) {
            for (int i = 0; i < a.members; ++i) open(a.first_member + i, other);
        } else if (b.members > 0) {
            for (int i = 0; i < b.members; ++i) open(first, b.first_member + i);
        } else {
            const double found = in_tube_ ? clearance_in_tube(first, other) : clearance(first, other);
            const std::size_t to = place_of(a, b);
            if (!(found < least_[to])) return;
            least_[to] = found;
            which_[2 * to] = first, which_[2 * to + 1] = other;
        }
    }
};

}  // namespace spacearm_proof
