// The interface of a base model: how a motion of the joints is looked at where the robot is in space.
//
// A model answers for one motion at a time. `follow` takes the motion; then `place` puts the robot where it is at a
// pack of instants, and `peak_turn`, `rate` and the others tell what the base does. All is told in the frame of the
// base as it stands at the beginning. Who asks does not know which model it is: a new model is a new class here, and a
// line in `base_models.hpp`.
#pragma once

#include <memory>

#include "motion/problem.hpp"

namespace SPACEARM_NAMESPACE {

// Dense: four times as many as fine, for what few motions are asked.
enum class sampling : std::uint8_t { coarse, fine, dense };

// An instant of the coarse sampling: a pack and its lane; or the start's or the goal's configuration itself.
struct instant {
    static constexpr int start = -1, goal = -2;
    int pack, lane = 0;
};

// What the search goes by, without knowing the model.
struct search_hints {
    int looks_per_question = 8;      // motions looked at between two questions whether time is up
    int tree_share = 1;              // the trees' samples of a turn are divided by this
    bool trees_find_motions = true;  // whether a path with free edges becomes a motion: the base does not move
    bool dense = true;               // whether there is a dense sampling; else the fine one is all there is
};

template <class T> class base_model {
  public:
    explicit base_model(const motion_problem<T>& problem) : p_(problem) {}
    base_model(const base_model&) = delete;
    virtual ~base_model() = default;

    std::int64_t configurations = 0;  // looked at so far

    // ---- a motion's instants, pack by pack
    // Takes a motion, which has to stay until the next. `with_frames`: `place` will be asked for.
    virtual void follow(const motion<T>& m, sampling density, bool with_frames) = 0;
    // The packs of that sampling, those that mostly tell first; the fine one need not repeat the coarse one.
    virtual int packs() const = 0;
    // Whether they are all there are: the fine sampling has the coarse one's, too.
    virtual bool repeats_coarse() const = 0;
    // Where an instant of a pack is along the motion, from 0 to 1.
    virtual double instant_at(int pack, int lane) const = 0;
    // Puts the joints' frames where they are at a pack, as far as points and envelope need them; returns the base's
    // frame, or nullptr where it is as it was at the beginning.
    virtual const frame<T>* place(int pack, frame<T>* frames) = 0;
    // The same at the motion's end, in the last lane.
    virtual const frame<T>* place_end(frame<T>* frames) = 0;
    // The instants of the coarse sampling in time, from the beginning to the end.
    virtual const std::vector<instant>& path() const = 0;

    // ---- what the base does on the motion followed last, per unit of s where it is a rate
    virtual double final_turn() const = 0;  // the angle by which the base is turned at the end [rad]
    virtual double peak_turn() const = 0;   // the greatest one [rad]
    virtual T rate() const = 0;             // the greatest rate of the base [rad]
    virtual T arm_momentum() const = 0;     // the greatest angular momentum of the arm on a base at rest [N m s^2]
    // How long a motion lasts, given its fastest time within the limits [s].
    virtual T duration(T fastest) const = 0;

    // What it misses of the terminal constraints.
    virtual terminal_residual missed(const terminal_constraints& asked) const = 0;

    // ---- a motion's end alone, which takes other nodes than its clearance
    virtual terminal_residual at_end(const motion<T>& m, const terminal_constraints& asked, bool roughly) = 0;
    // Position and attitude wxyz of the base at nodes 0 to `nodes`, or at the last alone: rows of 7.
    virtual void poses(const motion<T>& m, int nodes, bool last_only, T* out) = 0;

    // ---- the search
    virtual const search_hints& hints() const = 0;
    // An instant at which a proof failed, and others around it (the lanes, the middle one is it): looked at in the fine
    // sampling from now on. What was missed once will be missed again elsewhere, so the sampling becomes twice as
    // dense.
    virtual void add_instants(const std::vector<double>& around) = 0;
    // The joints at configurations q, in the frame of the base.
    SPACEARM_NOINLINE void place_joints(const pack<T>* q, frame<T>* frames) const {
        forward_kinematics(p_.scene.robot, q, frames);
    }
    int edge_packs() const { return edge_packs_; }  // of a straight edge between two configurations
    void look_closer_at_edges() {
        if (edge_packs_ < most_edge_packs) edge_packs_ *= 2;  // failed proofs may have made them denser still
    }

  protected:
    static constexpr int most_instants = 4096, most_edge_packs = 64;

    const std::vector<T>& added_table(int interior) {
        std::vector<T>& values = added_tables_[interior];
        while (values.size() < pack_offset<T>(static_cast<int>(added_.size()), interior)) {
            append_instants(values, interior, 0, added_[values.size() / pack_offset<T>(1, interior)]);
        }
        return values;
    }

    const motion_problem<T>& p_;
    int edge_packs_ = 1;
    std::vector<std::vector<double>> added_;  // packs of instants

  private:
    std::map<int, std::vector<T>> added_tables_;  // by the number of interior control points
};

}  // namespace SPACEARM_NAMESPACE
