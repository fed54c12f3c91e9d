// The least clearance of every link and every other body at instants: measured, not proven.
//
// Pairs of outermost bodies are opened as far as their balls do not settle them: a bundle is replaced by its members,
// and two shapes are measured. What is more than asked for, or than what is found for the same two bodies, is not
// measured.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "proof/bodies.hpp"
#include "proof/nearest_points.hpp"
#include "proof/tube.hpp"

namespace spacearm_proof {

// A body at an instant; `placed` points into `points`, or into the table for bodies that never move.
struct BodyAtInstant {
    std::vector<double> points;
    PlacedBody placed;
    Vec3 center;
    std::size_t instant;  // 1 + the instant that it is placed for; 0: none
};

// Clearances of pairs of bodies. Columns are the other bodies: obstacles first, then links.
class Clearances {
  public:
    // The tables are not copied.
    explicit Clearances(const Tables& tables)
        : tables_(tables), bodies_(tables.bodies), pairs_(tables.pairs), frames_in_all_(tables.pairs.frames),
          at_(bodies_.count()) {
        const Frame still = identity();
        for (int body = 0; body < bodies_.count(); ++body) {
            at_[body].instant = 0;
            if (bodies_[body].frame == world) place(body, still, nullptr);
        }
    }

    Clearances(const Clearances&) = delete;
    Clearances& operator=(const Clearances&) = delete;

    // Lower `least` (links, obstacles + links), for two links in the row of the one that comes first, to what they have
    // at one instant. frames: by frame, world and base first. Pairs with a limit of minus infinity are left out. All
    // values of `least` are to be at most the limits. which: (links, obstacles + links, 2) is set to the two shapes
    // where something is found; or null. tube: what it takes is taken from all clearances; or null.
    void least(const double* frames, int links, int obstacles, const double* limit, double* least,
               std::int64_t* which = nullptr, const Tube* tube = nullptr) {
        ++instant_;
        tube_ = tube;
        begin(links, obstacles, limit);
        frames_ = frames, least_ = least, which_ = which;
        for (std::size_t i = 0; i < pairs_.first.size(); ++i) open(pairs_.first[i], pairs_.other[i]);
    }

    // The clearance of two bodies at one instant.
    double between(const double* frames, int first, int other) {
        ++instant_;
        frames_ = frames;
        return nearest_points(at(first).placed, at(other).placed).clearance;
    }
    int count() const { return bodies_.count(); }

    // Throws if there are fewer errors than degrees of freedom.
    Tube tube_of(const double* tracking, std::size_t count) const {
        if (count != static_cast<std::size_t>(tables_.joints.dofs))
            throw std::invalid_argument("clearances: expected a tracking error for each degree of freedom");
        return Tube(tables_, tracking);
    }

    // Throws if there are other frames than the tables', or fewer links or obstacles than the bodies name.
    void require_frames(std::size_t frames) const {
        if (frames != static_cast<std::size_t>(frames_in_all_))
            throw std::invalid_argument("clearances: the frames are not those of the tables");
    }
    void require_owners(std::size_t links, std::size_t obstacles) const {
        for (const Body& body : bodies_.list)
            if (body.owner >= static_cast<int>(body.frame == world ? obstacles : links))
                throw std::invalid_argument("clearances: the limits are not those of the bodies");
    }

  private:
    const Tables& tables_;
    const Bodies& bodies_;
    const Pairs& pairs_;
    const int frames_in_all_;
    std::vector<BodyAtInstant> at_;
    std::vector<double> limit_;  // by link and body: of a bundle of several obstacles the greatest of its members
    std::size_t instant_ = 0;
    const double* frames_ = nullptr;
    double* least_ = nullptr;
    std::int64_t* which_ = nullptr;
    const Tube* tube_ = nullptr;
    int columns_ = 0, obstacles_ = 0;

    void begin(int links, int obstacles, const double* limit) {
        columns_ = obstacles + links, obstacles_ = obstacles;
        const std::size_t count = bodies_.count();
        limit_.resize(links * count);
        for (int link = 0; link < links; ++link) {
            double* of_body = limit_.data() + link * count;
            for (std::size_t i = 0; i < count; ++i) {
                const Body& body = bodies_[static_cast<int>(i)];
                if (body.owner >= 0) of_body[i] = limit[link * columns_ + column(body)];
                else
                    of_body[i] =
                        *std::max_element(of_body + body.first_member, of_body + body.first_member + body.members);
            }
        }
    }

    int column(const Body& body) const { return body.frame == world ? body.owner : obstacles_ + body.owner; }

    std::size_t place_of(const Body& first, const Body& other) const {
        int row = first.owner, of = column(other);
        if (other.frame != world && other.owner < row) row = other.owner, of = obstacles_ + first.owner;
        return static_cast<std::size_t>(row) * columns_ + of;
    }

    void place(int body, const Frame& frame, const double* moved) {
        const Body& of = bodies_[body];
        BodyAtInstant& to = at_[body];
        const double* points = bodies_.vertices.data() + 3 * of.first_point;
        Vec3 axis = of.axis, center = of.center;
        if (moved != nullptr) {
            to.points.resize(3 * of.points);
            for (int i = 0; i < of.points; ++i) {
                const Vec3 p = frame.placed(vec3(points + 3 * i));
                to.points[3 * i] = p.x, to.points[3 * i + 1] = p.y, to.points[3 * i + 2] = p.z;
            }
            points = to.points.data(), axis = frame.turned(axis), center = frame.placed(center);
        }
        to.placed = {points, of.points, of.disc, {axis.x, axis.y, axis.z}, of.radius, of.half_space};
        to.center = center, to.instant = instant_;
    }

    const BodyAtInstant& at(int body) {
        const Body& of = bodies_[body];
        BodyAtInstant& here = at_[body];
        if (of.frame != world && here.instant != instant_) {
            Frame frame;
            std::copy_n(frames_ + 12 * of.frame, 12, frame.T);
            place(body, frame, frames_);
        }
        return here;
    }

    // Whether the balls around two bodies are further apart than `enough`.
    bool far(int first, int other, double enough) {
        const Body &a = bodies_[first], &b = bodies_[other];
        const BodyAtInstant &x = at(first), &y = at(other);
        const Vec3 to = x.center - y.center;
        if (b.half_space)
            return dot(vec3(y.placed.axis), x.center - vec3(y.placed.points)) - a.reach - a.radius > enough;
        const double all = enough + a.reach + a.radius + b.reach + b.radius;
        return all < 0.0 || dot(to, to) > all * all;
    }

    void open(int first, int other) {
        const Body &a = bodies_[first], &b = bodies_[other];
        double enough = limit_[static_cast<std::size_t>(a.owner) * bodies_.count() + other];
        const bool one = b.owner >= 0;
        if (one) enough = std::min(enough, least_[place_of(a, b)]);
        if (!(enough > -std::numeric_limits<double>::infinity())) return;
        const bool in_tube = tube_ != nullptr && tube_->any();
        const int motion = in_tube ? pairs_.motion(a.frame, b.frame) : 0;
        const Frame* joints = reinterpret_cast<const Frame*>(frames_) + first_joint;
        if (far(first, other, enough + (in_tube ? tube_->at_most(joints, at(first).center, first, motion) : 0.0)))
            return;
        if (a.members > 0 && (b.members == 0 || a.radius > b.radius)) {
            for (int i = 0; i < a.members; ++i) open(a.first_member + i, other);
        } else if (b.members > 0) {
            for (int i = 0; i < b.members; ++i) open(first, b.first_member + i);
        } else {
            const Nearest near = nearest_points(at(first).placed, at(other).placed);
            double found = near.clearance;
            if (in_tube) found -= tube_->lost(joints, at(first).center, first, motion, vec3(near.n));
            const std::size_t to = place_of(a, b);
            if (!(found < least_[to])) return;
            least_[to] = found;
            if (which_ != nullptr) which_[2 * to] = first, which_[2 * to + 1] = other;
        }
    }
};

}  // namespace spacearm_proof
