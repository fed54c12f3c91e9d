// Adaptive bisection with first-order bounds, in the place of the finder of proofs: kernel/proof/proof_module.cpp is
// compiled with this file instead of its own, so that all but the search is the same program.
//
// A pair of bodies on a stretch is settled if its distance at the midpoint is more than the displacement bound
// (Schwarzer, Saha and Latombe 2005); else the stretch is halved, or a bundle gives way to its members. `nodes` counts
// distance queries, `stretches` configurations. The distances are believed.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "proof/bodies.hpp"
#include "proof/motion_bounds.hpp"
#include "proof/nearest_points.hpp"
#include "proof/path_tree.hpp"

namespace spacearm_proof {

enum class Status { holds = 0, fails = 1, undecided = 2 };

struct Suspect {
    int first = -1, other = -1;
    double u = 0, clearance = std::numeric_limits<double>::infinity();
};

struct Found {
    Status status = Status::holds;
    std::vector<std::uint8_t> steps;
    std::vector<double> directions;
    std::vector<Suspect> closest;
    Suspect worst;
    std::int64_t nodes = 0, stretches = 0;
};

class Finder {
  public:
    Finder(const Tables& tables, Path& path, MotionBounds& motion, const Held& held, double resolution,
           std::function<void()> ask)
        : tables_(tables), path_(path), motion_(motion), held_(held), resolution_(resolution), ask_(std::move(ask)) {
        found_.closest.resize(held.phases);
    }

    Found find() {
        std::vector<Level> levels(1);
        levels[0].stretch = path_.whole();
        for (std::size_t i = 0; i < tables_.pairs.first.size(); ++i)
            levels[0].open.push_back({tables_.pairs.first[i], tables_.pairs.other[i]});
        while (!levels.empty() && found_.status == Status::holds) {
            const Level now = std::move(levels.back());
            levels.pop_back();
            if (now.stretch.share < resolution_ || found_.stretches > most_stretches) {
                found_.status = Status::undecided;
                break;
            }
            deal_with(now, levels);
        }
        return std::move(found_);
    }

  private:
    static constexpr std::int64_t most_stretches = 1'000'000;
    static constexpr double spare = 1.0, nearly = 0.45;  // when a bundle is opened: as the finder does it

    struct Pair {
        int first, other;
    };
    struct Level {
        Stretch stretch;
        std::vector<Pair> open;
    };

    void deal_with(const Level& now, std::vector<Level>& levels) {
        motion_.begin(now.stretch);
        if (++found_.stretches % 64 == 0) ask_();
        std::vector<Pair> work = now.open, halved;
        for (std::size_t i = 0; i < work.size(); ++i) {
            const Pair pair = work[i];
            const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
            const double held = held_.on(a.owner, pair.other, now.stretch.begin, now.stretch.end).clearance;
            const double distance = nearest_points(motion_.placed(pair.first), motion_.placed(pair.other)).clearance;
            const double loss = motion_.bounds(pair.first, tables_.pairs.motion(a.frame, b.frame)).first;
            ++found_.nodes;
            if (distance - loss > held) continue;
            const bool bundles = a.members > 0 || b.members > 0;
            const double radii = (a.members > 0 ? a.radius : 0.0) + (b.members > 0 ? b.radius : 0.0);
            if (bundles && distance - held + spare * radii > loss && distance - held < nearly * loss) open(pair, work);
            else if (!bundles && distance <= held) {
                found_.status = Status::fails;
                found_.worst = {pair.first, pair.other, now.stretch.middle(), distance};
                return;
            } else halved.push_back(pair);
        }
        if (halved.empty()) return;
        Stretch one, other;
        path_.halve(now.stretch, one, other);
        levels.push_back({other, halved});
        levels.push_back({one, std::move(halved)});
    }

    void open(const Pair& pair, std::vector<Pair>& work) const {
        const Body &a = tables_.bodies[pair.first], &b = tables_.bodies[pair.other];
        const bool own = a.members > 0 && (b.members == 0 || a.radius >= b.radius);
        const Body& bundle = own ? a : b;
        for (int i = bundle.first_member; i < bundle.first_member + bundle.members; ++i)
            work.push_back(own ? Pair{i, pair.other} : Pair{pair.first, i});
    }

    const Tables& tables_;
    Path& path_;
    MotionBounds& motion_;
    const Held& held_;
    double resolution_;
    std::function<void()> ask_;
    Found found_;
};

}  // namespace spacearm_proof
