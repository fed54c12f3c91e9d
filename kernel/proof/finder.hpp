// The search for a proof that bodies keep apart along a path: for every pair, stretches of the path and planes that
// separate the two on them.
//
// A node of the proof is a pair of bodies on a stretch. It is settled by a plane; or its stretch is halved; or the
// members of a bundle take the place of the bundle. All nodes on a stretch are dealt with one after the other, so that
// what is known of the stretch is computed once. First some instants are measured: the least excess, which is what a
// pair has more than it is held to, says how much is to be proven.
//
// Nothing proven rests on this file: the checker makes the nodes anew, and verifies each plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "proof/bodies.hpp"
#include "proof/motion_bounds.hpp"
#include "proof/nearest_points.hpp"
#include "proof/overlap.hpp"
#include "proof/path_tree.hpp"

namespace spacearm_proof {

enum Step : std::uint8_t { is_settled = 0, halves = 1, members_of_first = 2, members_of_other = 3 };
enum class Status { holds = 0, fails = 1, undecided = 2 };

struct Suspect {
    int first = -1, other = -1;  // shapes of the table; -1: none was measured
    double u = 0, clearance = std::numeric_limits<double>::infinity();
};

struct Found {
    Status status = Status::holds;
    std::vector<std::uint8_t> steps;
    std::vector<double> directions;
    std::vector<Suspect> closest;  // by phase
    Suspect worst;
    std::int64_t nodes = 0, stretches = 0;
};

class Finder {
  public:
    // resolution: no shorter share of the path is looked at. ask: is called now and then, and may throw.
    Finder(const Tables& tables, Path& path, MotionBounds& motion, const Held& held, double resolution,
           std::function<void()> ask)
        : tables_(tables), path_(path), motion_(motion), held_(held), resolution_(resolution), ask_(std::move(ask)),
          least_(held.known_excess, held.known_excess + held.phases) {
        found_.closest.resize(held.phases);
    }

    Found find() {
        if (!tables_.pairs.first.empty()) {
            measure_instants(path_.whole(), instant_halvings);
            if (!ended()) search();
            if (found_.status == Status::fails) measure_failure();
        }
        found_.nodes = static_cast<std::int64_t>(nodes_.size());
        if (found_.status == Status::holds) write_tree();
        if (found_.worst.first < 0) found_.worst = least_suspect_;
        return std::move(found_);
    }

  private:
    static constexpr double guard = 1e-9;            // [m] a gap is reduced by this, for its rounding
    static constexpr double relative_guard = 4e-13;  // and by this times the coordinates, more than the checker does
    static constexpr double margin = 2e-9;      // [m] to be proven more than is asked for: the checker rounds otherwise
    static constexpr int instant_halvings = 4;  // 2^4 instants are measured first
    static constexpr int instants_of_failure = 7;        // and 2^7 to find the worst one of a motion that fails
    static constexpr int closer_looks = 4, between = 8;  // then around it, so many times closer each time
    static constexpr std::int64_t most_stretches = 100'000, most_nodes = 3'000'000;
    // When a bundle is opened, and its stretch not halved; numbers tried on motions of five robots.
    static constexpr double spare = 1.5;    // times a bundle's radius: so much more clearance its members may have
    static constexpr double nearly = 0.15;  // times the loss: with less than this above the target, halves do not help
    static constexpr double little = 0.5;   // times a bundle's radius: such a loss is not what is in the way
    static constexpr int few_members = 4;   // such a bundle is opened if that settles all of them
    // Fewer settled nodes than this do not pay for a stretch whose halves are needed, by the checker's times.
    static constexpr std::size_t worth_fixed = 6, worth_floating = 10;

    struct Node {
        int first, other, child, direction;  // -1: none
        Step step;
    };
    // A node to be dealt with. n: a direction that may be right, in the other body's frame.
    struct Open {
        int node;
        bool guessed;
        Vec3 n;
    };
    struct Settled {
        int node;
        Vec3 n;
    };
    struct Level {
        std::vector<Stretch> stretches;
        std::vector<std::size_t> first;  // of the nodes on each stretch, and their number at last
        std::vector<Open> open;
    };
    // A pair on the stretch at hand.
    struct Pair {
        int first, other, motion;
        bool balls;  // both cores are points
        double radii, guard;
        Held::At held;
        double target;
    };
    struct Plane {
        Vec3 n{0, 0, 0};
        double gap = -infinite, loss = 0;
    };
    static constexpr double infinite = std::numeric_limits<double>::infinity();

    bool ended() const { return found_.status != Status::holds; }

    // ---- measurements -----------------------------------------------------------------------------------------------

    // Measure the closest pairs of every phase at the midpoints of all stretches that are `halvings` below one.
    void measure_instants(const Stretch& stretch, int halvings) {
        if (halvings > 0) {
            Stretch one, other;
            path_.halve(stretch, one, other);
            measure_instants(one, halvings - 1);
            if (other.last > other.first) measure_instants(other, halvings - 1);
            return;
        }
        measure_at(stretch.middle());
    }

    // Measure a motion that fails at more instants, and around the worst one.
    void measure_failure() {
        const Stretch whole = path_.whole();
        measure_instants(whole, instants_of_failure);
        double apart = (whole.end - whole.begin) / (1 << instants_of_failure);
        for (int turn = 0; turn < closer_looks; ++turn, apart /= between) {
            const double u = least_suspect_.u;
            for (int i = -between; i <= between; ++i)
                measure_at(std::clamp(u + i * apart / between, whole.begin, whole.end));
        }
    }

    void measure_at(double u) {
        u_ = u;
        motion_.place(u);
        const Pairs& pairs = tables_.pairs;
        const std::size_t count = pairs.first.size();
        at_least_.resize(count);
        std::size_t closest = 0;
        for (std::size_t i = 0; i < count; ++i) {
            at_least_[i] = excess_at_least(pairs.first[i], pairs.other[i]);
            if (at_least_[i] < at_least_[closest]) closest = i;
        }
        measure_within(pairs.first[closest], pairs.other[closest], at_least_[closest]);
        for (std::size_t i = 0; i < count; ++i)
            if (i != closest) measure_within(pairs.first[i], pairs.other[i], at_least_[i]);
    }

    Held::At held_at(int first, int other, double u) const {
        return held_.on(tables_.bodies[first].owner, other, u, u);
    }
    static double around(const Body& body) { return body.reach + body.radius; }

    // What two bodies have more than they are held to is at least this, by the balls around them.
    double excess_at_least(int first, int other) {
        const Body &a = tables_.bodies[first], &b = tables_.bodies[other];
        const Vec3 between = motion_.center(first) - motion_.center(other);
        const double apart = b.half_space ? dot(b.axis, between) : length(between) - around(b);
        return apart - around(a) - needed(first, other);
    }
    // What two bodies are held to, and what a tracking error takes at most.
    double needed(int first, int other) {
        const int motion = tables_.pairs.motion(tables_.bodies[first].frame, tables_.bodies[other].frame);
        return held_at(first, other, u_).clearance + motion_.tube_at_most(first, motion);
    }
    // The same by the ball around the first body alone, which tells more of a large obstacle.
    double bundle_excess(int first, int other) {
        const Nearest near = nearest_points(motion_.placed(first), motion_.placed(other));
        return near.apart ? near.clearance - needed(first, other) : -infinite;
    }

    // Measure the pairs of shapes within a pair that may have the least excess of their phase.
    void measure_within(int first, int other, double at_least) {
        const Body &a = tables_.bodies[first], &b = tables_.bodies[other];
        if (a.members == 0 && b.members == 0) {
            if (at_least < least_[held_at(first, other, u_).phase]) measure(first, other, nullptr);
            return;
        }
        const double least = least_of_any(first, other);
        if (at_least >= least) return;
        if (b.points > 1 && bundle_excess(first, other) >= least) return;
        const bool own = opens_first(a, b);
        const Body& bundle = own ? a : b;
        for (int i = bundle.first_member; i < bundle.first_member + bundle.members; ++i) {
            const int one = own ? i : first, another = own ? other : i;
            measure_within(one, another, excess_at_least(one, another));
        }
    }

    // The least excess so far that a pair's parts may be below of: of its phase, or of any if its parts have several.
    double least_of_any(int first, int other) {
        if (tables_.bodies[other].owner >= 0 || held_.phases == 2) return least_[held_at(first, other, u_).phase];
        return *std::max_element(least_.begin(), least_.end() - 1);
    }

    Nearest measure(int first, int other, const double* guess) {
        const PlacedBody a = motion_.placed(first), b = motion_.placed(other);
        Nearest near = nearest_points(a, b, guess);
        if (!near.apart && !b.half_space)
            near.clearance = clearance_of_overlap(a, b, motion_.center(first) - motion_.center(other));
        remember(first, other, near.clearance, vec3(near.n));
        return near;
    }
    // n: from the other body to the first one. A tracking error takes from what the pair has.
    void remember(int first, int other, double clearance, Vec3 n) {
        const Held::At at = held_at(first, other, u_);
        Suspect& closest = found_.closest[at.phase];
        if (clearance < closest.clearance) closest = {first, other, u_, clearance};
        const int motion = tables_.pairs.motion(tables_.bodies[first].frame, tables_.bodies[other].frame);
        const double measured = clearance - at.clearance, excess = measured - motion_.lost_in_tube(first, motion, n);
        least_[at.phase] = std::min(least_[at.phase], excess);
        if (excess < least_excess_) {
            least_excess_ = excess;
            least_suspect_ = {first, other, u_, clearance};
            if (measured <= 0) found_.status = Status::fails;
            else if (excess <= guard && !ended()) found_.status = Status::undecided;
        }
    }

    // ---- the search, level by level ---------------------------------------------------------------------------------

    void search() {
        const Pairs& pairs = tables_.pairs;
        Level now;
        now.stretches.push_back(path_.whole());
        now.first = {0, pairs.first.size()};
        for (std::size_t i = 0; i < pairs.first.size(); ++i)
            now.open.push_back({add_node(pairs.first[i], pairs.other[i]), false, {0, 0, 0}});
        while (!now.stretches.empty() && !ended()) {
            Level next;
            next.first.push_back(0);
            for (std::size_t i = 0; i < now.stretches.size() && !ended(); ++i) {
                work_.assign(now.open.begin() + now.first[i], now.open.begin() + now.first[i + 1]);
                deal_with(now.stretches[i], next);
                ++found_.stretches;
                ask_();
                if (found_.stretches > most_stretches || nodes_.size() > most_nodes) give_up(least_suspect_);
            }
            now = std::move(next);
        }
    }

    int add_node(int first, int other) {
        nodes_.push_back({first, other, -1, -1, is_settled});
        return static_cast<int>(nodes_.size()) - 1;
    }

    void write_settled() {
        for (const Settled& one : settled_) {
            nodes_[one.node].direction = static_cast<int>(directions_.size());
            directions_.push_back(one.n);
        }
    }

    // Planes on a stretch cost the checker as much as some more nodes. The halves are looked at anyway.
    void halve_settled() {
        for (const Settled& one : settled_) {
            const Frame& frame = motion_.frame(tables_.bodies[nodes_[one.node].other].frame);
            halved_.push_back({one.node, true, frame.turned_back(one.n)});
        }
    }

    void give_up(const Suspect& at) {
        if (ended()) return;
        found_.status = Status::undecided;
        found_.worst = at;
    }

    // Deal with the nodes of work_ on a stretch; what is to be halved goes to the next level.
    void deal_with(const Stretch& stretch, Level& next) {
        stretch_ = stretch;
        u_ = stretch.middle();
        motion_.begin(stretch);
        Stretch half[2];
        path_.halve(stretch, half[0], half[1]);
        divisible_ = stretch.share / 2 >= resolution_ && half[0].begin < half[0].end && half[1].begin < half[1].end;
        halved_.clear();
        settled_.clear();
        for (std::size_t i = 0; i < work_.size() && !ended(); ++i) deal_with(work_[i]);
        if (ended()) return;
        const std::size_t worth = motion_.floating() ? worth_floating : worth_fixed;
        if (halved_.empty() || settled_.size() >= worth) write_settled();
        else halve_settled();
        if (halved_.empty()) return;
        for (const Open& open : halved_) {
            Node& node = nodes_[open.node];
            node.step = halves;
            node.child = static_cast<int>(nodes_.size());
            const int first = node.first, other = node.other;
            add_node(first, other);
            add_node(first, other);
        }
        for (int side = 0; side < 2; ++side) {
            next.stretches.push_back(half[side]);
            for (const Open& open : halved_)
                next.open.push_back({nodes_[open.node].child + side, open.guessed, open.n});
            next.first.push_back(next.open.size());
        }
    }

    void deal_with(Open open) {
        const Pair pair = pair_of(nodes_[open.node].first, nodes_[open.node].other);
        const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
        const bool bundles = a.members > 0 || b.members > 0;
        const Plane plane = plane_of(pair, open);
        if (settles(pair, plane)) return settled_.push_back({open.node, plane.n});
        if (bundles && (!divisible_ || must_open(pair, plane))) return open_members(open.node, a, b);
        if (bundles && open_if_settled(open.node, a, b)) return;
        if (!divisible_) return give_up({pair.first, pair.other, u_, plane.gap + pair.guard});
        halved_.push_back(open);
    }

    bool must_open(const Pair& pair, const Plane& plane) {
        const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
        const double tube = motion_.lost_in_tube(pair.first, pair.motion, plane.n);  // halves lose it too
        const double left = plane.gap - pair.target - tube, loss = plane.loss - tube;
        const double radii = (a.members > 0 ? a.radius : 0.0) + (b.members > 0 ? b.radius : 0.0);
        return left < nearly * loss && (left + spare * radii > loss || loss < little * radii);
    }

    static bool settles(const Pair& pair, const Plane& plane) { return plane.gap - plane.loss > pair.target; }

    // Whether the members of the first body take its place, if a pair is opened; else those of the other one.
    static bool opens_first(const Body& a, const Body& b) {
        return a.members > 0 && (b.members == 0 || a.radius >= b.radius);
    }

    // Open a bundle with few members if that settles them all; this takes fewer nodes than two halves, and no stretch.
    bool open_if_settled(int node, const Body& a, const Body& b) {
        const bool own = opens_first(a, b);
        const Body& bundle = own ? a : b;
        if (bundle.members > few_members) return false;
        Vec3 n[few_members];
        for (int i = 0; i < bundle.members; ++i) {
            const int member = bundle.first_member + i;
            const Pair pair = pair_of(own ? member : nodes_[node].first, own ? nodes_[node].other : member);
            Open open{-1, false, {0, 0, 0}};
            const Plane plane = plane_of(pair, open);
            if (!settles(pair, plane)) return false;
            n[i] = plane.n;
        }
        const std::size_t first = work_.size();
        open_members(node, a, b);
        for (int i = 0; i < bundle.members; ++i) settled_.push_back({work_[first + i].node, n[i]});
        work_.resize(first);
        return true;
    }

    void open_members(int node, const Body& a, const Body& b) {
        const bool own = opens_first(a, b);
        const Body& bundle = own ? a : b;
        const int first = nodes_[node].first, other = nodes_[node].other;
        nodes_[node].step = own ? members_of_first : members_of_other;
        nodes_[node].child = static_cast<int>(nodes_.size());
        for (int i = bundle.first_member; i < bundle.first_member + bundle.members; ++i)
            work_.push_back({own ? add_node(i, other) : add_node(first, i), false, {0, 0, 0}});
    }

    // ---- planes -----------------------------------------------------------------------------------------------------

    Pair pair_of(int first, int other) {
        const Body &a = tables_.bodies[first], &b = tables_.bodies[other];
        Pair out;
        out.first = first;
        out.other = other;
        out.motion = tables_.pairs.motion(a.frame, b.frame);
        out.balls = a.points == 1 && a.disc == 0 && (b.half_space || (b.points == 1 && b.disc == 0));
        out.radii = a.radius + (b.half_space ? 0.0 : b.radius);
        const double size = length(motion_.center(first)) + a.reach + length(motion_.center(other)) + b.reach;
        out.guard = guard + relative_guard * size;
        out.held = held_.on(a.owner, other, stretch_.begin, stretch_.end);
        const double excess = least_[out.held.phase];  // infinite: no pair of this phase was measured
        const bool known = excess > 0 && excess < infinite;
        out.target = out.held.clearance + margin + (known ? held_.share[out.held.phase] * excess : 0.0);
        return out;
    }

    // The direction from middle to middle; of a half-space its axis.
    Vec3 toward(const Pair& pair) {
        const Body& b = tables_.bodies[pair.other];
        if (b.half_space) return b.axis;
        const Vec3 between = motion_.center(pair.first) - motion_.center(pair.other);
        const double apart = length(between);
        return apart > 0 ? (1 / apart) * between : Vec3{0, 0, 1};
    }

    Plane plane_of(const Pair& pair, Open& open) {
        const Plane out = pair.balls ? plane_of_balls(pair) : plane_of_shapes(pair, open);
        const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
        if (a.members == 0 && b.members == 0 && pair.balls)
            remember(pair.first, pair.other, out.gap + pair.guard, out.n);
        return out;
    }

    Plane plane_of_balls(const Pair& pair) {
        const Vec3 c = motion_.center(pair.first);
        Plane out;
        out.n = toward(pair);
        out.gap = dot(out.n, c - motion_.center(pair.other)) - pair.radii - pair.guard;
        const BodyMotion& moves = motion_.bounds(pair.first, pair.motion);
        out.loss = moves.first;
        if (out.gap - out.loss > pair.target || out.gap <= pair.target) return out;
        const FrameMotion& frame = motion_.motion(pair.motion);
        const double speed = std::abs(dot(out.n, frame.push) + dot(cross(out.n, frame.omega), c));
        const double tube = motion_.tube_along(pair.first, pair.motion, out.n);
        out.loss = std::min(out.loss, speed * motion_.half() + moves.second + tube);
        return out;
    }

    // Try a direction that may be right, or that from middle to middle, and then that of the nearest points.
    Plane plane_of_shapes(const Pair& pair, Open& open) {
        const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
        const Frame& frame = motion_.frame(b.frame);
        const Vec3 guess = open.guessed ? frame.turned(open.n) : toward(pair);
        Plane out = plane_along(pair, guess);
        if (out.gap - out.loss > pair.target || b.half_space) {
            if (b.half_space && b.members == 0 && a.members == 0)
                remember(pair.first, pair.other, out.gap + pair.guard, out.n);
            return out;
        }
        const double apart = dot(toward(pair), motion_.center(pair.first) - motion_.center(pair.other));
        const double at_most = apart - pair.radii - pair.guard;
        const BodyMotion& moves = motion_.bounds(pair.first, pair.motion);
        const double loss = std::min(moves.first, moves.second);
        if (at_most > pair.target && at_most - loss <= pair.target && divisible_) return out;
        const double n[3] = {guess.x, guess.y, guess.z};
        Nearest near;
        if (a.members == 0 && b.members == 0) near = measure(pair.first, pair.other, n);
        else near = nearest_points(motion_.placed(pair.first), motion_.placed(pair.other), n);
        const Vec3 better = vec3(near.n);
        open.guessed = near.apart;
        if (near.apart) {
            open.n = frame.turned_back(better);
            const Plane second = plane_along(pair, better);
            if (second.gap - second.loss > out.gap - out.loss) out = second;
        }
        return out;
    }

    Plane plane_along(const Pair& pair, Vec3 n) {
        const PlacedBody a = motion_.placed(pair.first), b = motion_.placed(pair.other);
        Plane out;
        out.n = n;
        const double level = extent(b, n) + pair.radii + pair.guard;
        const BodyMotion& moves = motion_.bounds(pair.first, pair.motion);
        const double disc = a.disc > 0 ? a.disc * across(n, vec3(a.axis)) : 0.0;
        double least = infinite;
        for (int i = 0; i < a.count; ++i) least = std::min(least, dot(n, vec3(a.points + 3 * i)));
        out.gap = least - disc - level;
        out.loss = moves.first;
        if (out.gap - out.loss > pair.target || out.gap <= pair.target) return out;
        const FrameMotion& frame = motion_.motion(pair.motion);
        const Vec3 turning = cross(n, frame.omega);
        const double half = motion_.half(), pushed = dot(n, frame.push);
        const double widened = a.disc > 0 ? a.disc * across_length(turning, vec3(a.axis)) * half : 0.0;
        const double second = moves.second + motion_.tube_along(pair.first, pair.motion, n);
        double left = infinite;
        for (int i = 0; i < a.count; ++i) {
            const Vec3 x = vec3(a.points + 3 * i);
            const double speed = std::abs(pushed + dot(turning, x)) * half + widened;
            left = std::min(left, dot(n, x) - disc - level - std::min(speed + second, moves.first));
        }
        out.loss = out.gap - left;
        return out;
    }

    // The greatest height of a body's core along n.
    static double extent(const PlacedBody& b, Vec3 n) {
        double most = -infinite;
        for (int i = 0; i < b.count; ++i) most = std::max(most, dot(n, vec3(b.points + 3 * i)));
        return b.disc > 0 && !b.half_space ? most + b.disc * across(n, vec3(b.axis)) : most;
    }
    // The length of a unit vector's part across an axis, rounded up by a little.
    static double across(Vec3 n, Vec3 axis) { return across_length(n, axis); }
    static double across_length(Vec3 v, Vec3 axis) {
        const double along = dot(v, axis), squared = dot(v, v);
        return std::sqrt(std::max(squared - along * along, 0.0));
    }

    // ---- the result -------------------------------------------------------------------------------------------------

    int children(const Node& node) const {
        if (node.step == is_settled) return 0;
        if (node.step == halves) return 2;
        return tables_.bodies[node.step == members_of_first ? node.first : node.other].members;
    }

    // Level by level: the roots, then all nodes that follow from them, in their order.
    void write_tree() {
        std::vector<int> order(tables_.pairs.first.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
        order.reserve(nodes_.size());
        found_.steps.reserve(nodes_.size());
        found_.directions.reserve(3 * directions_.size());
        for (std::size_t i = 0; i < order.size(); ++i) {
            const Node& node = nodes_[order[i]];
            found_.steps.push_back(node.step);
            if (node.step == is_settled) {
                const Vec3 n = directions_[node.direction];
                found_.directions.insert(found_.directions.end(), {n.x, n.y, n.z});
            }
            for (int k = 0; k < children(node); ++k) order.push_back(node.child + k);
        }
    }

    const Tables& tables_;
    Path& path_;
    MotionBounds& motion_;
    const Held& held_;
    double resolution_;
    std::function<void()> ask_;
    std::vector<double> least_, at_least_;  // least_: by phase, the least excess seen
    double least_excess_ = infinite;
    Suspect least_suspect_;
    Found found_;
    std::vector<Node> nodes_;
    std::vector<Vec3> directions_;
    std::vector<Open> work_, halved_;
    std::vector<Settled> settled_;
    Stretch stretch_{};
    double u_ = 0;
    bool divisible_ = true;
};

}  // namespace spacearm_proof
