// Checks of what a caller gives: what does not fit raises std::invalid_argument, which is a ValueError in Python.
//
// Python has checked what its users give, so a refusal here is a defect of ours; but it must never reach memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

namespace SPACEARM_NAMESPACE {

inline void require(bool condition, const char* what) {
    if (!condition) throw std::invalid_argument(what);
}
// A number of a size that may be multiplied, even squared, and stays a number; a NaN is none.
inline bool within(double x, double most) { return std::abs(x) <= most; }
template <class Numbers> bool all_within(const Numbers& numbers, double most) {
    return std::all_of(std::begin(numbers), std::end(numbers), [&](auto x) { return within(double(x), most); });
}
inline constexpr double widest = 1e9;        // [m] of robots and scenes: a square of a square of it is a float still
inline constexpr double most_weight = 1e12;  // of anything that is multiplied

}  // namespace SPACEARM_NAMESPACE
