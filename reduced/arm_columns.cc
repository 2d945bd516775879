#include "reduced/arm_columns.h"

#include "reduced/vector_clones.h"

namespace mantle::reduced {
namespace {

#define MANTLE_INLINE inline __attribute__((always_inline))

constexpr int kMost = kMostColumns;

// y = A x for a 3x3 block by columns and three rows of x; or y += A x.
template <bool add>
MANTLE_INLINE void Times3(int c, const double* a, const double* x, double* y) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < c; ++j) {
      const double sum = a[i] * x[j] + a[i + 3] * x[c + j] + a[i + 6] * x[2 * c + j];
      y[i * c + j] = add ? y[i * c + j] + sum : sum;
    }
  }
}

// y += w x x for three rows of x.
MANTLE_INLINE void AddCross(int c, const double* w, const double* x, double* y) {
  for (int j = 0; j < c; ++j) {
    const double a = x[j], b = x[c + j], d = x[2 * c + j];
    y[j] += w[1] * d - w[2] * b;
    y[c + j] += w[2] * a - w[0] * d;
    y[2 * c + j] += w[0] * b - w[1] * a;
  }
}

// y += ad_v x
MANTLE_INLINE void AddAdjoint(int c, const double* v, const double* x, double* y) {
  AddCross(c, v, x, y);
  AddCross(c, v + 3, x, y + 3 * c);
  AddCross(c, v, x + 3 * c, y + 3 * c);
}

// y += [F 0; G F] x
MANTLE_INLINE void AddTangent(int c, const TangentBlocks& t, const double* x, double* y) {
  Times3<true>(c, t.f.data(), x, y);
  Times3<true>(c, t.f.data(), x + 3 * c, y + 3 * c);
  Times3<true>(c, t.g.data(), x, y + 3 * c);
}

// y = Ad_h x
MANTLE_INLINE void ToRoot(int c, const IntervalState& s, const double* x, double* y) {
  Times3<false>(c, s.rotation.data(), x, y);
  Times3<false>(c, s.rotation.data(), x + 3 * c, y + 3 * c);
  AddCross(c, s.position.data(), y, y + 3 * c);
}

MANTLE_INLINE void MakeColumnsOf(int c, const double* e, const double* e1, const double* e2,
                                 IntervalState* s) {
  double *const s0 = s->columns.data(), *const s1 = s->columns1.data(),
                *const s2 = s->columns2.data();
  double local[6 * kMost], once[6 * kMost];
  const auto zero = [&](double* x) {
    for (int i = 0; i < 6 * c; ++i) x[i] = 0.0;
  };
  zero(local);
  AddTangent(c, s->jet.value, e, local);
  ToRoot(c, *s, local, s0);

  zero(local);
  AddTangent(c, s->jet.rate, e, local);
  if (e1 != nullptr) AddTangent(c, s->jet.value, e1, local);
  ToRoot(c, *s, local, s1);  // 2 of it and ad_V S enter S''
  for (int i = 0; i < 6 * c; ++i) once[i] = 2.0 * s1[i];
  zero(local);
  AddAdjoint(c, s->twist.data(), s0, local);
  for (int i = 0; i < 6 * c; ++i) {
    once[i] += local[i];
    s1[i] += local[i];
  }

  zero(local);
  if (e1 != nullptr) {
    AddTangent(c, s->jet.rate, e1, local);
    for (int i = 0; i < 6 * c; ++i) local[i] *= 2.0;
  }
  AddTangent(c, s->jet.second, e, local);
  if (e2 != nullptr) AddTangent(c, s->jet.value, e2, local);
  ToRoot(c, *s, local, s2);
  AddAdjoint(c, s->twist.data(), once, s2);
  AddAdjoint(c, s->acceleration.data(), s0, s2);
}

// y = A x or A^T x for a 6x6 matrix; or y += it.
template <bool add, bool transposed>
MANTLE_INLINE void Times6(int c, const Matrix6& a, const double* x, double* y) {
  const double* const m = a.data();
  for (int i = 0; i < 6; ++i) {
    double sum[kMost];
    for (int j = 0; j < c; ++j) sum[j] = add ? y[i * c + j] : 0.0;
    for (int k = 0; k < 6; ++k) {
      const double f = transposed ? m[k + 6 * i] : m[i + 6 * k];
      for (int j = 0; j < c; ++j) sum[j] += f * x[k * c + j];
    }
    for (int j = 0; j < c; ++j) y[i * c + j] = sum[j];
  }
}

// out += scale x^T y for x of c columns and y of d columns, out by columns.
MANTLE_INLINE void AddTransposed(int c, const double* x, int d, const double* y, double* out,
                                 int stride) {
  for (int b = 0; b < d; ++b) {
    double sum[kMost];
    double* const column = out + b * stride;
    for (int a = 0; a < c; ++a) sum[a] = column[a];
    for (int k = 0; k < 6; ++k) {
      const double f = y[k * d + b];
      for (int a = 0; a < c; ++a) sum[a] += f * x[k * c + a];
    }
    for (int a = 0; a < c; ++a) column[a] = sum[a];
  }
}

MANTLE_INLINE void AddIntervalOf(int c, const Composite& beyond, bool needs_rotation,
                                 const double* e, const Matrix6& local, const IntervalState& s,
                                 GroupSums* g, double* mass, double* damping, double* stiffness,
                                 int stride) {
  const int size = 6 * c;
  const double *const s0 = s.columns.data(), *const s1 = s.columns1.data(),
                      *const s2 = s.columns2.data();
  double m[6 * kMost], m2[6 * kMost], d[6 * kMost], k[6 * kMost], y[6 * kMost], z[6 * kMost];
  double* const sum0 = g->columns.data();
  double* const sum1 = g->columns1.data();
  double* const sum2 = g->columns2.data();
  Times6<false, false>(c, beyond.inertia, s0, m);
  for (int i = 0; i < size; ++i) m2[i] = 2.0 * m[i];
  Times6<false, false>(c, beyond.inertia, s1, d);
  for (int i = 0; i < size; ++i) d[i] *= 2.0;
  Times6<true, false>(c, beyond.rate, s0, d);
  Times6<false, false>(c, beyond.inertia, s2, k);
  Times6<true, false>(c, beyond.rate, s1, k);
  Times6<false, true>(c, beyond.rate, s0, y);
  if (needs_rotation) {
    Times6<true, false>(c, beyond.rotation, s0, k);
    Times6<false, true>(c, beyond.rotation, s0, z);
  }
  // with the sums up to this interval, then before it
  AddTransposed(c, sum0, c, m, mass, stride);
  AddTransposed(c, sum0, c, d, damping, stride);
  AddTransposed(c, s0, c, k, stiffness, stride);
  for (int i = 0; i < size; ++i) {
    sum0[i] -= s0[i];
    sum1[i] -= s1[i];
    sum2[i] -= s2[i];
  }
  // Tests before feel the wrenches beyond turn with the section: -N(W) S.
  double turn[6];
  for (int i = 0; i < 6; ++i) turn[i] = -s.wrench(i);
  AddCross(c, turn, s0, k);
  AddCross(c, turn + 3, s0 + 3 * c, k);
  AddCross(c, turn + 3, s0, k + 3 * c);
  AddTransposed(c, m, c, sum0, mass, stride);
  AddTransposed(c, m2, c, sum1, damping, stride);
  AddTransposed(c, y, c, sum0, damping, stride);
  AddTransposed(c, sum0, c, k, stiffness, stride);
  AddTransposed(c, m, c, sum2, stiffness, stride);
  AddTransposed(c, y, c, sum1, stiffness, stride);
  if (needs_rotation) AddTransposed(c, z, c, sum0, stiffness, stride);
  const auto add = [&](const double* x, Columns* sum) {
    double* const to = sum->data();
    for (int i = 0; i < size; ++i) to[i] += x[i];
  };
  add(m, &g->mass);
  add(d, &g->damping);
  add(k, &g->stiffness);
  add(y, &g->rate);
  if (needs_rotation) add(z, &g->rotation);
  Times6<false, false>(c, local, e, m);
  AddTransposed(c, e, c, m, stiffness, stride);
}

MANTLE_INLINE void CoupleGroupsOf(int p, const GroupSums& earlier, int c, const GroupSums& group,
                                  bool needs_rotation, const GroupBlocks& upper,
                                  const GroupBlocks& lower, int stride) {
  const double *const e0 = earlier.columns.data(), *const e1 = earlier.columns1.data(),
                      *const e2 = earlier.columns2.data();
  const double *const m = group.mass.data(), *const y = group.rate.data();
  AddTransposed(p, e0, c, m, upper.mass, stride);
  AddTransposed(p, e0, c, group.damping.data(), upper.damping, stride);
  AddTransposed(p, e0, c, group.stiffness.data(), upper.stiffness, stride);
  AddTransposed(c, m, p, e0, lower.mass, stride);
  AddTransposed(c, m, p, e1, lower.damping, stride);
  AddTransposed(c, m, p, e1, lower.damping, stride);
  AddTransposed(c, y, p, e0, lower.damping, stride);
  AddTransposed(c, m, p, e2, lower.stiffness, stride);
  AddTransposed(c, y, p, e1, lower.stiffness, stride);
  if (needs_rotation) AddTransposed(c, group.rotation.data(), p, e0, lower.stiffness, stride);
}

}  // namespace

// The usual numbers of columns as constants, so that their loops unroll.

MANTLE_VECTOR_CLONES void MakeColumns(int count, const double* e, const double* e1,
                                      const double* e2, IntervalState* s) {
  if (count == 4) return MakeColumnsOf(4, e, e1, e2, s);
  if (count == 6) return MakeColumnsOf(6, e, e1, e2, s);
  MakeColumnsOf(count, e, e1, e2, s);
}

MANTLE_VECTOR_CLONES void AddInterval(int count, const Composite& beyond, bool needs_rotation,
                                      const double* e, const Matrix6& local, const IntervalState& s,
                                      GroupSums* group, double* mass, double* damping,
                                      double* stiffness, int stride) {
  const auto add = [&](int c) __attribute__((always_inline)) {
    AddIntervalOf(c, beyond, needs_rotation, e, local, s, group, mass, damping, stiffness, stride);
  };
  if (count == 4) return add(4);
  if (count == 6) return add(6);
  add(count);
}

MANTLE_VECTOR_CLONES void CoupleGroups(int earlier_count, const GroupSums& earlier, int count,
                                       const GroupSums& group, bool needs_rotation,
                                       const GroupBlocks& upper, const GroupBlocks& lower,
                                       int stride) {
  const auto couple = [&](int p, int c) __attribute__((always_inline)) {
    CoupleGroupsOf(p, earlier, c, group, needs_rotation, upper, lower, stride);
  };
  if (count == 4 && earlier_count == 4) return couple(4, 4);
  if (count == 6 && earlier_count == 6) return couple(6, 6);
  couple(earlier_count, count);
}

}  // namespace mantle::reduced
