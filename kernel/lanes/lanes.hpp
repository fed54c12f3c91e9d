// How a lane operation becomes an instruction: the one file that knows the machine.
//
// A pack holds SPACEARM_PACK_BYTES worth of numbers side by side, one configuration (or particle, or sample) a lane.
// Everything above this file is ordinary C++ on packs. Each level (x86-64-v2, -v3, -v4, generic) is a build of its own,
// in a namespace of its own, chosen at import.
//
// Arithmetic is plain IEEE: no contraction into fused multiply-adds, no reassociation, square roots and divisions
// correctly rounded. So every level, pack width and thread count gives the same bits.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if SPACEARM_LEVEL >= 2
#include <immintrin.h>
#endif

#ifndef SPACEARM_PACK_BYTES
#define SPACEARM_PACK_BYTES 64
#endif

#define SPACEARM_INLINE inline __attribute__((always_inline))
// For what is large and called from several places: one copy of its code stays in the instruction cache.
#define SPACEARM_NOINLINE __attribute__((noinline))

// For what is large and called in a loop: inlined where a pack is one or two registers. Where it is more, the code is
// as many times as long, and one copy compiles in a fraction of the time.
#if SPACEARM_LEVEL >= 3
#define SPACEARM_INLINE_REGISTERS SPACEARM_INLINE
#else
#define SPACEARM_INLINE_REGISTERS SPACEARM_NOINLINE
#endif

namespace SPACEARM_NAMESPACE {

// ---- one register ---------------------------------------------------------------------------------------------------
//
// reg<T> wraps the machine's register; mask<T> is what a comparison gives. Only these need intrinsics: with vector
// extensions alone, GCC takes min, max, abs, sqrt and selections apart into scalars.

template <class T> struct reg;
template <class T> struct mask;

#if SPACEARM_LEVEL == 4
// The forms with a mask of all lanes are the same instructions; GCC's plain ones begin with a value that is not set.
#define SPACEARM_REG(T, V, M, S)                                                                                       \
    template <> struct mask<T> {                                                                                       \
        M m;                                                                                                           \
    };                                                                                                                 \
    template <> struct reg<T> {                                                                                        \
        V v;                                                                                                           \
        static constexpr int lanes = 64 / sizeof(T);                                                                   \
        static SPACEARM_INLINE reg set(T x) { return {_mm512_set1_##S(x)}; }                                           \
        static SPACEARM_INLINE reg load(const T* p) { return {_mm512_loadu_##S(p)}; }                                  \
        SPACEARM_INLINE void store(T* p) const { _mm512_storeu_##S(p, v); }                                            \
    };                                                                                                                 \
    SPACEARM_INLINE reg<T> add(reg<T> a, reg<T> b) { return {_mm512_add_##S(a.v, b.v)}; }                              \
    SPACEARM_INLINE reg<T> sub(reg<T> a, reg<T> b) { return {_mm512_sub_##S(a.v, b.v)}; }                              \
    SPACEARM_INLINE reg<T> mul(reg<T> a, reg<T> b) { return {_mm512_mul_##S(a.v, b.v)}; }                              \
    SPACEARM_INLINE reg<T> div(reg<T> a, reg<T> b) { return {_mm512_div_##S(a.v, b.v)}; }                              \
    SPACEARM_INLINE reg<T> min(reg<T> a, reg<T> b) { return {_mm512_maskz_min_##S(static_cast<M>(-1), a.v, b.v)}; }    \
    SPACEARM_INLINE reg<T> max(reg<T> a, reg<T> b) { return {_mm512_maskz_max_##S(static_cast<M>(-1), a.v, b.v)}; }    \
    SPACEARM_INLINE reg<T> sqrt(reg<T> a) { return {_mm512_maskz_sqrt_##S(static_cast<M>(-1), a.v)}; }                 \
    SPACEARM_INLINE reg<T> abs(reg<T> a) { return {_mm512_abs_##S(a.v)}; }                                             \
    SPACEARM_INLINE reg<T> nearest(reg<T> a) {                                                                         \
        return {_mm512_maskz_roundscale_##S(static_cast<M>(-1), a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)};  \
    }                                                                                                                  \
    SPACEARM_INLINE mask<T> less(reg<T> a, reg<T> b) { return {_mm512_cmp_##S##_mask(a.v, b.v, _CMP_LT_OQ)}; }         \
    SPACEARM_INLINE mask<T> less_equal(reg<T> a, reg<T> b) { return {_mm512_cmp_##S##_mask(a.v, b.v, _CMP_LE_OQ)}; }   \
    SPACEARM_INLINE mask<T> both(mask<T> a, mask<T> b) { return {static_cast<M>(a.m & b.m)}; }                         \
    SPACEARM_INLINE mask<T> either(mask<T> a, mask<T> b) { return {static_cast<M>(a.m | b.m)}; }                       \
    SPACEARM_INLINE bool any(mask<T> a) { return a.m != 0; }                                                           \
    SPACEARM_INLINE bool all(mask<T> a) { return a.m == static_cast<M>(-1); }                                          \
    SPACEARM_INLINE reg<T> select(mask<T> m, reg<T> a, reg<T> b) { return {_mm512_mask_blend_##S(m.m, b.v, a.v)}; }
SPACEARM_REG(float, __m512, __mmask16, ps)
SPACEARM_REG(double, __m512d, __mmask8, pd)
#undef SPACEARM_REG

#elif SPACEARM_LEVEL == 3 || SPACEARM_LEVEL == 2
#if SPACEARM_LEVEL == 3
#define SPACEARM_P(op) _mm256_##op
#define SPACEARM_LESS(S, a, b) _mm256_cmp_##S(a, b, _CMP_LT_OQ)
#define SPACEARM_LESS_EQUAL(S, a, b) _mm256_cmp_##S(a, b, _CMP_LE_OQ)
#define SPACEARM_VF __m256
#define SPACEARM_VD __m256d
#else
#define SPACEARM_P(op) _mm_##op
#define SPACEARM_LESS(S, a, b) _mm_cmplt_##S(a, b)
#define SPACEARM_LESS_EQUAL(S, a, b) _mm_cmple_##S(a, b)
#define SPACEARM_VF __m128
#define SPACEARM_VD __m128d
#endif
#define SPACEARM_REG(T, V, S)                                                                                          \
    template <> struct mask<T> {                                                                                       \
        V m;                                                                                                           \
    };                                                                                                                 \
    template <> struct reg<T> {                                                                                        \
        V v;                                                                                                           \
        static constexpr int lanes = sizeof(V) / sizeof(T);                                                            \
        static SPACEARM_INLINE reg set(T x) { return {SPACEARM_P(set1_##S)(x)}; }                                      \
        static SPACEARM_INLINE reg load(const T* p) { return {SPACEARM_P(loadu_##S)(p)}; }                             \
        SPACEARM_INLINE void store(T* p) const { SPACEARM_P(storeu_##S)(p, v); }                                       \
    };                                                                                                                 \
    SPACEARM_INLINE reg<T> add(reg<T> a, reg<T> b) { return {SPACEARM_P(add_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> sub(reg<T> a, reg<T> b) { return {SPACEARM_P(sub_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> mul(reg<T> a, reg<T> b) { return {SPACEARM_P(mul_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> div(reg<T> a, reg<T> b) { return {SPACEARM_P(div_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> min(reg<T> a, reg<T> b) { return {SPACEARM_P(min_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> max(reg<T> a, reg<T> b) { return {SPACEARM_P(max_##S)(a.v, b.v)}; }                         \
    SPACEARM_INLINE reg<T> sqrt(reg<T> a) { return {SPACEARM_P(sqrt_##S)(a.v)}; }                                      \
    SPACEARM_INLINE reg<T> abs(reg<T> a) {                                                                             \
        return {SPACEARM_P(andnot_##S)(SPACEARM_P(set1_##S)(static_cast<T>(-0.0)), a.v)};                              \
    }                                                                                                                  \
    SPACEARM_INLINE reg<T> nearest(reg<T> a) {                                                                         \
        return {SPACEARM_P(round_##S)(a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)};                            \
    }                                                                                                                  \
    SPACEARM_INLINE mask<T> less(reg<T> a, reg<T> b) { return {SPACEARM_LESS(S, a.v, b.v)}; }                          \
    SPACEARM_INLINE mask<T> less_equal(reg<T> a, reg<T> b) { return {SPACEARM_LESS_EQUAL(S, a.v, b.v)}; }              \
    SPACEARM_INLINE mask<T> both(mask<T> a, mask<T> b) { return {SPACEARM_P(and_##S)(a.m, b.m)}; }                     \
    SPACEARM_INLINE mask<T> either(mask<T> a, mask<T> b) { return {SPACEARM_P(or_##S)(a.m, b.m)}; }                    \
    SPACEARM_INLINE bool any(mask<T> a) { return SPACEARM_P(movemask_##S)(a.m) != 0; }                                 \
    SPACEARM_INLINE bool all(mask<T> a) { return SPACEARM_P(movemask_##S)(a.m) == (1 << reg<T>::lanes) - 1; }          \
    SPACEARM_INLINE reg<T> select(mask<T> m, reg<T> a, reg<T> b) { return {SPACEARM_P(blendv_##S)(b.v, a.v, m.m)}; }
SPACEARM_REG(float, SPACEARM_VF, ps)
SPACEARM_REG(double, SPACEARM_VD, pd)
#undef SPACEARM_REG
#undef SPACEARM_P
#undef SPACEARM_LESS
#undef SPACEARM_LESS_EQUAL
#undef SPACEARM_VF
#undef SPACEARM_VD

#else  // generic: scalars; the compiler vectorises what it can
template <class T> struct mask {
    bool m;
};
template <class T> struct reg {
    T v;
    static constexpr int lanes = 1;
    static SPACEARM_INLINE reg set(T x) { return {x}; }
    static SPACEARM_INLINE reg load(const T* p) { return {*p}; }
    SPACEARM_INLINE void store(T* p) const { *p = v; }
};
template <class T> SPACEARM_INLINE reg<T> add(reg<T> a, reg<T> b) { return {a.v + b.v}; }
template <class T> SPACEARM_INLINE reg<T> sub(reg<T> a, reg<T> b) { return {a.v - b.v}; }
template <class T> SPACEARM_INLINE reg<T> mul(reg<T> a, reg<T> b) { return {a.v * b.v}; }
template <class T> SPACEARM_INLINE reg<T> div(reg<T> a, reg<T> b) { return {a.v / b.v}; }
// As the x86 instructions have it: the second operand when either is NaN.
template <class T> SPACEARM_INLINE reg<T> min(reg<T> a, reg<T> b) { return {a.v < b.v ? a.v : b.v}; }
template <class T> SPACEARM_INLINE reg<T> max(reg<T> a, reg<T> b) { return {a.v > b.v ? a.v : b.v}; }
SPACEARM_INLINE reg<float> sqrt(reg<float> a) { return {__builtin_sqrtf(a.v)}; }
SPACEARM_INLINE reg<double> sqrt(reg<double> a) { return {__builtin_sqrt(a.v)}; }
SPACEARM_INLINE reg<float> abs(reg<float> a) { return {__builtin_fabsf(a.v)}; }
SPACEARM_INLINE reg<double> abs(reg<double> a) { return {__builtin_fabs(a.v)}; }
SPACEARM_INLINE reg<float> nearest(reg<float> a) { return {__builtin_rintf(a.v)}; }
SPACEARM_INLINE reg<double> nearest(reg<double> a) { return {__builtin_rint(a.v)}; }
template <class T> SPACEARM_INLINE mask<T> less(reg<T> a, reg<T> b) { return {a.v < b.v}; }
template <class T> SPACEARM_INLINE mask<T> less_equal(reg<T> a, reg<T> b) { return {a.v <= b.v}; }
template <class T> SPACEARM_INLINE mask<T> both(mask<T> a, mask<T> b) { return {a.m && b.m}; }
template <class T> SPACEARM_INLINE mask<T> either(mask<T> a, mask<T> b) { return {a.m || b.m}; }
template <class T> SPACEARM_INLINE bool any(mask<T> a) { return a.m; }
template <class T> SPACEARM_INLINE bool all(mask<T> a) { return a.m; }
template <class T> SPACEARM_INLINE reg<T> select(mask<T> m, reg<T> a, reg<T> b) { return {m.m ? a.v : b.v}; }
#endif

// ---- a pack: as many registers as make the lanes --------------------------------------------------------------------

template <class T> inline constexpr int lanes_of = SPACEARM_PACK_BYTES / sizeof(T);

template <class T> struct pack {
    static constexpr int lanes = lanes_of<T>;
    static constexpr int regs = lanes / reg<T>::lanes;
    static_assert(regs * reg<T>::lanes == lanes);
    reg<T> r[regs];

    pack() = default;
    SPACEARM_INLINE pack(T x) {
        for (int i = 0; i < regs; ++i) r[i] = reg<T>::set(x);
    }
    static SPACEARM_INLINE pack load(const T* p) {
        pack out;
        for (int i = 0; i < regs; ++i) out.r[i] = reg<T>::load(p + i * reg<T>::lanes);
        return out;
    }
    SPACEARM_INLINE void store(T* p) const {
        for (int i = 0; i < regs; ++i) r[i].store(p + i * reg<T>::lanes);
    }
};

template <class T> struct pack_mask {
    mask<T> m[pack<T>::regs];
};

#define SPACEARM_BINARY(name, op)                                                                                      \
    template <class T> SPACEARM_INLINE pack<T> name(const pack<T>& a, const pack<T>& b) {                              \
        pack<T> out;                                                                                                   \
        for (int i = 0; i < pack<T>::regs; ++i) out.r[i] = op(a.r[i], b.r[i]);                                         \
        return out;                                                                                                    \
    }                                                                                                                  \
    template <class T> SPACEARM_INLINE pack<T> name(const pack<T>& a, T b) { return name(a, pack<T>(b)); }             \
    template <class T> SPACEARM_INLINE pack<T> name(T a, const pack<T>& b) { return name(pack<T>(a), b); }
SPACEARM_BINARY(operator+, add)
SPACEARM_BINARY(operator-, sub)
SPACEARM_BINARY(operator*, mul)
SPACEARM_BINARY(operator/, div)
SPACEARM_BINARY(min, min)
SPACEARM_BINARY(max, max)
#undef SPACEARM_BINARY

#define SPACEARM_UNARY(name)                                                                                           \
    template <class T> SPACEARM_INLINE pack<T> name(const pack<T>& a) {                                                \
        pack<T> out;                                                                                                   \
        for (int i = 0; i < pack<T>::regs; ++i) out.r[i] = name(a.r[i]);                                               \
        return out;                                                                                                    \
    }
SPACEARM_UNARY(sqrt)
SPACEARM_UNARY(abs)
SPACEARM_UNARY(nearest)
#undef SPACEARM_UNARY

template <class T> SPACEARM_INLINE pack<T> operator-(const pack<T>& a) { return pack<T>(T(0)) - a; }
template <class T> SPACEARM_INLINE pack<T>& operator+=(pack<T>& a, const pack<T>& b) { return a = a + b; }
template <class T> SPACEARM_INLINE pack<T>& operator-=(pack<T>& a, const pack<T>& b) { return a = a - b; }

#define SPACEARM_COMPARE(name, op)                                                                                     \
    template <class T> SPACEARM_INLINE pack_mask<T> name(const pack<T>& a, const pack<T>& b) {                         \
        pack_mask<T> out;                                                                                              \
        for (int i = 0; i < pack<T>::regs; ++i) out.m[i] = op(a.r[i], b.r[i]);                                         \
        return out;                                                                                                    \
    }                                                                                                                  \
    template <class T> SPACEARM_INLINE pack_mask<T> name(const pack<T>& a, T b) { return name(a, pack<T>(b)); }
SPACEARM_COMPARE(operator<, less)
SPACEARM_COMPARE(operator<=, less_equal)
#undef SPACEARM_COMPARE

#define SPACEARM_JOIN(name, op)                                                                                        \
    template <class T> SPACEARM_INLINE pack_mask<T> name(const pack_mask<T>& a, const pack_mask<T>& b) {               \
        pack_mask<T> out;                                                                                              \
        for (int i = 0; i < pack<T>::regs; ++i) out.m[i] = op(a.m[i], b.m[i]);                                         \
        return out;                                                                                                    \
    }
SPACEARM_JOIN(operator|, either)
SPACEARM_JOIN(operator&, both)
#undef SPACEARM_JOIN

template <class T> SPACEARM_INLINE bool any(const pack_mask<T>& a) {
    mask<T> joined = a.m[0];
    for (int i = 1; i < pack<T>::regs; ++i) joined = either(joined, a.m[i]);
    return any(joined);
}
// A comparison with a NaN is false. So what must not take a NaN for fine asks whether all lanes are: `!all(a <= b)`.
template <class T> SPACEARM_INLINE bool all(const pack_mask<T>& a) {
    mask<T> joined = a.m[0];
    for (int i = 1; i < pack<T>::regs; ++i) joined = both(joined, a.m[i]);
    return all(joined);
}
template <class T> SPACEARM_INLINE pack<T> select(const pack_mask<T>& m, const pack<T>& a, const pack<T>& b) {
    pack<T> out;
    for (int i = 0; i < pack<T>::regs; ++i) out.r[i] = select(m.m[i], a.r[i], b.r[i]);
    return out;
}
// x where it is above 0, else 0; a NaN stays one (the machine's max gives its second operand where either is NaN).
template <class T> SPACEARM_INLINE pack<T> above_zero(const pack<T>& x) { return max(pack<T>(T(0)), x); }
// A NaN becomes the lower bound.
template <class T> SPACEARM_INLINE pack<T> clamp(const pack<T>& x, const pack<T>& lower, const pack<T>& upper) {
    return min(max(x, lower), upper);
}

// ---- over a pack's lanes --------------------------------------------------------------------------------------------
template <class T> SPACEARM_INLINE T sum_of(const pack<T>& x) {
    T lane[lanes_of<T>], sum = 0;
    x.store(lane);
    for (int i = 0; i < lanes_of<T>; ++i) sum += lane[i];
    return sum;
}
template <class T> SPACEARM_INLINE T greatest_of(const pack<T>& x) {
    T lane[lanes_of<T>];
    x.store(lane);
    return *std::max_element(lane, lane + lanes_of<T>);
}

// ---- unsigned 32-bit lanes, for the random numbers ------------------------------------------------------------------
//
// Additions, exclusive ors and shifts of vector types do become single instructions, so the extension serves here. The
// words are as many as a float pack's lanes; a double pack takes half of them.

inline constexpr int word_lanes = lanes_of<float>;
typedef std::uint32_t words __attribute__((vector_size(4 * word_lanes)));
template <class T> inline constexpr int packs_of_words = word_lanes / lanes_of<T>;

template <int R, class W> SPACEARM_INLINE W rotate_left(W x) { return (x << R) | (x >> (32 - R)); }

// Words as numbers in [0, 1): 24 of the 32 bits for float (all that fit), all 32 for double. Exact at every level.
SPACEARM_INLINE void uniform(const words& x, pack<float> (&out)[1]) {
    typedef std::int32_t integers __attribute__((vector_size(4 * word_lanes)));
    typedef float reals __attribute__((vector_size(4 * word_lanes)));
    const words top = x >> 8;
    const reals u = __builtin_convertvector(reinterpret_cast<const integers&>(top), reals) * 0x1p-24f;
    out[0] = pack<float>::load(reinterpret_cast<const float*>(&u));
}
SPACEARM_INLINE void uniform(const words& x, pack<double> (&out)[2]) {
    typedef std::int32_t integers __attribute__((vector_size(2 * word_lanes)));
    typedef double reals __attribute__((vector_size(4 * word_lanes)));
    const words flipped = x ^ 0x80000000u;  // the machine converts signed words only: shift the range down and back up
    integers half[2];
    std::memcpy(half, &flipped, sizeof half);
    for (int i = 0; i < 2; ++i) {
        const reals u = (__builtin_convertvector(half[i], reals) + 0x1p31) * 0x1p-32;
        out[i] = pack<double>::load(reinterpret_cast<const double*>(&u));
    }
}

}  // namespace SPACEARM_NAMESPACE
