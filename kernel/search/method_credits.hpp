// Which of several methods has the next turn: the one that gained most for its work lately, a bandit's choice.
//
// A gain counts half as much after each further turn of its method. Each method has a tenth of all work at least: what
// did not pay once may pay later.
#pragma once

namespace SPACEARM_NAMESPACE {

template <int Count> class method_credits {
  public:
    // The next one of those that possible(i) names; -1 if it names none. Who had no turn yet comes first, in order.
    template <class Possible> int next(Possible&& possible) const {
        double all = 0;
        for (const account& a : accounts_) all += a.all_work;
        int best = -1;
        for (int i = 0; i < Count; ++i) {
            if (!possible(i)) continue;
            const account& a = accounts_[i];
            if (a.turns == 0 || a.all_work < least_share * all) return i;
            if (best < 0 || a.gain * accounts_[best].work > accounts_[best].gain * a.work) best = i;
        }
        return best;
    }
    // After a turn: the gain in any unit, the same for all, and the work it took.
    void book(int method, double gain, double work) {
        account& a = accounts_[method];
        a.gain = keeps * a.gain + gain;
        a.work = keeps * a.work + work;
        a.all_work += work;
        ++a.turns;
    }
    int turns(int method) const { return accounts_[method].turns; }

  private:
    struct account {
        double gain = 0, work = 0;  // lately
        double all_work = 0;
        int turns = 0;
    };
    static constexpr double keeps = 0.5;        // of what a method gained and worked, with each further turn
    static constexpr double least_share = 0.1;  // of all work, for each method
    account accounts_[Count];
};

}  // namespace SPACEARM_NAMESPACE
