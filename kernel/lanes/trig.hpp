// Sine and cosine of a pack, together and without a branch or a selection.
//
// Half the angle is reduced to [-pi/2, pi/2] (its sign (-1)^k cancels below), where short Chebyshev-fitted polynomials
// hold, and doubled: sin x = 2 s c, cos x = 1 - 2 s s. Absolute error below 1.2e-15 (double) and 6e-7 (float) for |x|
// up to 1e4; joints do not turn further. The polynomials were fitted with 60 digits on the squared argument.
//
// And single numbers, in double: angles by sine and cosine, cube roots. Those of the C library differ between
// libraries, and between processors that run the same one.
#pragma once

#include <cmath>
#include <limits>

#include "lanes/lanes.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct trig_constants;
template <> struct trig_constants<double> {
    static constexpr double pi[2] = {0x1.921fb544p+1, 0x1.0b4611a626331p-33};
    static constexpr double sin[8] = {-0x1.5555555555555p-3,  0x1.1111111111107p-7,   -0x1.a01a01a018aa6p-13,
                                      0x1.71de3a54562a8p-19,  -0x1.ae6455a1a9e7ep-26, 0x1.6124014cbe2fcp-33,
                                      -0x1.ae513415aadccp-41, 0x1.89a3f16388edcp-49};
    static constexpr double cos[8] = {-0x1.0p-1,
                                      0x1.5555555555526p-5,
                                      -0x1.6c16c16c13944p-10,
                                      0x1.a01a019d86aa7p-16,
                                      -0x1.27e4fa70ebb1bp-22,
                                      0x1.1eed1d54d6a10p-29,
                                      -0x1.9360b97f25b66p-37,
                                      0x1.a0d240fc1c26bp-45};
};
template <> struct trig_constants<float> {
    static constexpr float pi[2] = {0x1.92p+1f, 0x1.fb5444p-11f};
    static constexpr float sin[4] = {-0.16666665963263161434f, 0.0083332420809321064834f, -0.0001982273218069311822f,
                                     2.6347327186387517981e-6f};
    static constexpr float cos[5] = {-0.49999999963917204192f, 0.041666659354226758006f, -0.0013888651506409102628f,
                                     0.000024774569097256908187f, -2.629727096419640163e-7f};
};

template <class T, int N> SPACEARM_INLINE pack<T> polynomial(const T (&c)[N], const pack<T>& z) {
    pack<T> p(c[N - 1]);
    for (int i = N - 2; i >= 0; --i) p = p * z + c[i];
    return p;
}

template <class T> SPACEARM_INLINE void sincos(const pack<T>& x, pack<T>& sine, pack<T>& cosine) {
    using C = trig_constants<T>;
    const pack<T> half = x * T(0.5);
    const pack<T> k = nearest(half * T(0.31830988618379067154));
    const pack<T> y = (half - k * C::pi[0]) - k * C::pi[1];
    const pack<T> z = y * y;
    const pack<T> s = y + y * (z * polynomial(C::sin, z));
    const pack<T> c = z * polynomial(C::cos, z) + T(1);
    const pack<T> twice = s + s;
    sine = twice * c;
    cosine = T(1) - twice * s;
}

// ---- single numbers -------------------------------------------------------------------------------------------------
template <int N> inline double polynomial(const double (&c)[N], double z) {
    double p = c[N - 1];
    for (int i = N - 2; i >= 0; --i) p = p * z + c[i];
    return p;
}
inline void sincos(double x, double& sine, double& cosine) {  // the same bits as of a pack
    using C = trig_constants<double>;
    const double half = x * 0.5, k = __builtin_rint(half * 0.31830988618379067154);
    const double y = (half - k * C::pi[0]) - k * C::pi[1], z = y * y;
    const double s = y + y * (z * polynomial(C::sin, z)), c = z * polynomial(C::cos, z) + 1.0;
    const double twice = s + s;
    sine = twice * c;
    cosine = 1.0 - twice * s;
}

// The angle of the vector (x, y), from -pi to pi; 0 for (0, 0). A guess within 1e-5 (Abramowitz and Stegun, 4.4.47),
// then what sine and cosine say is left: to the last digit or two.
inline double angle_of(double y, double x) {
    constexpr double near[5] = {0.9998660, -0.3302995, 0.1801410, -0.0851330, 0.0208351};
    const double a = std::abs(x), b = std::abs(y), most = a < b ? b : a;
    if (most == 0) return 0;
    const double t = (a < b ? a : b) / most;
    double angle = t * polynomial(near, t * t), s, c;
    sincos(angle, s, c);
    const double left = (t * c - s) / (c + t * s);
    angle += left - left * left * left / 3;
    constexpr double half_turn = 3.14159265358979323846;
    if (a < b) angle = half_turn / 2 - angle;
    if (x < 0) angle = half_turn - angle;
    return y < 0 ? -angle : angle;
}
// Of a sine from 0 to 1; what rounding has put above is a right angle.
inline double angle_of_sine(double s) { return s < 1 ? angle_of(s, std::sqrt((1 - s) * (1 + s))) : angle_of(1, 0); }

// Newton's steps from a straight guess; of what is not above 0, or infinite, itself.
inline double cube_root(double x) {
    if (!(x > 0) || x > std::numeric_limits<double>::max()) return x;
    int exponent = 0;
    double m = std::frexp(x, &exponent);  // exact, as ldexp is
    while (exponent % 3 != 0) {           // twice at most: m from 1/8 to 1
        m /= 2;
        ++exponent;
    }
    double y = 0.4 + 0.6 * m;
    for (int i = 0; i < 6; ++i) y -= (y - m / (y * y)) / 3;
    return std::ldexp(y, exponent / 3);
}

}  // namespace SPACEARM_NAMESPACE
