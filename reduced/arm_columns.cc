#include "reduced/arm_columns.h"

#include "reduced/row.h"

namespace mantle::reduced {
namespace {

constexpr int kMost = kMostColumns;

// A row of any number of columns.
struct AnyRow {
  double x[kMost];
  int count;

  MANTLE_INLINE void Zero() {
    for (int j = 0; j < count; ++j) x[j] = 0.0;
  }
  MANTLE_INLINE void Load(const double* from) {
    for (int j = 0; j < count; ++j) x[j] = from[j];
  }
  MANTLE_INLINE void Add(double f, const double* from) {
    for (int j = 0; j < count; ++j) x[j] += f * from[j];
  }
  MANTLE_INLINE void Store(double* to) const {
    for (int j = 0; j < count; ++j) to[j] = x[j];
  }
};

template <int C>
MANTLE_INLINE auto MakeRow(int count) {
  if constexpr (C > 0) {
    return Row<C>();
  } else {
    AnyRow row;
    row.count = count;
    return row;
  }
}

// Kernels on 6 x C columns at `x`, c = C or any number.
template <int C>
struct Kernel {
  int c;

  // y = A x (or y += A x) for a 3x3 block by columns and three rows of x.
  MANTLE_INLINE void Times3(bool add, const double* a, const double* x, double* y) const {
    for (int i = 0; i < 3; ++i) {
      auto sum = MakeRow<C>(c);
      if (add) {
        sum.Load(y + i * c);
      } else {
        sum.Zero();
      }
      for (int k = 0; k < 3; ++k) sum.Add(a[i + 3 * k], x + k * c);
      sum.Store(y + i * c);
    }
  }

  // y += w x x for three rows of x.
  MANTLE_INLINE void AddCross(const double* w, const double* x, double* y) const {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      auto sum = MakeRow<C>(c);
      sum.Load(y + i * c);
      sum.Add(w[j], x + k * c);
      sum.Add(-w[k], x + j * c);
      sum.Store(y + i * c);
    }
  }

  // y += ad_v x
  MANTLE_INLINE void AddAdjoint(const double* v, const double* x, double* y) const {
    AddCross(v, x, y);
    AddCross(v + 3, x, y + 3 * c);
    AddCross(v, x + 3 * c, y + 3 * c);
  }

  // y += [F 0; G F] x
  MANTLE_INLINE void AddTangent(const TangentBlocks& t, const double* x, double* y) const {
    Times3(true, t.f.data(), x, y);
    Times3(true, t.f.data(), x + 3 * c, y + 3 * c);
    Times3(true, t.g.data(), x, y + 3 * c);
  }

  // y = Ad_h x
  MANTLE_INLINE void ToRoot(const IntervalState& s, const double* x, double* y) const {
    Times3(false, s.rotation.data(), x, y);
    Times3(false, s.rotation.data(), x + 3 * c, y + 3 * c);
    AddCross(s.position.data(), y, y + 3 * c);
  }

  // y = A x or A^T x for a 6x6 matrix; or y += it.
  MANTLE_INLINE void Times6(bool add, bool transposed, const Matrix6& a, const double* x,
                            double* y) const {
    const double* const m = a.data();
    for (int i = 0; i < 6; ++i) {
      auto sum = MakeRow<C>(c);
      if (add) {
        sum.Load(y + i * c);
      } else {
        sum.Zero();
      }
      for (int k = 0; k < 6; ++k) sum.Add(transposed ? m[k + 6 * i] : m[i + 6 * k], x + k * c);
      sum.Store(y + i * c);
    }
  }

  // out += x^T y for y of d columns; out by columns.
  MANTLE_INLINE void AddTransposed(const double* x, int d, const double* y, double* out,
                                   int stride) const {
    for (int b = 0; b < d; ++b) {
      auto sum = MakeRow<C>(c);
      sum.Load(out + b * stride);
      for (int k = 0; k < 6; ++k) sum.Add(y[k * d + b], x + k * c);
      sum.Store(out + b * stride);
    }
  }

  // y += f x
  MANTLE_INLINE void Accumulate(double f, const double* x, double* y) const {
    for (int i = 0; i < 6; ++i) {
      auto sum = MakeRow<C>(c);
      sum.Load(y + i * c);
      sum.Add(f, x + i * c);
      sum.Store(y + i * c);
    }
  }
  MANTLE_INLINE void Zero(double* y) const {
    for (int i = 0; i < 6 * c; ++i) y[i] = 0.0;
  }
};

template <int C>
using Local = double[6 * (C > 0 ? C : kMost)];

template <int C>
MANTLE_INLINE void MakeColumnsOf(int c, const double* e, const double* e1, const double* e2,
                                 IntervalState* s) {
  const Kernel<C> kernel{C > 0 ? C : c};
  double *const s0 = s->columns.data(), *const s1 = s->columns1.data(),
                *const s2 = s->columns2.data();
  Local<C> local, turned, twice;
  kernel.Zero(local);
  kernel.AddTangent(s->jet.value, e, local);
  kernel.ToRoot(*s, local, s0);

  kernel.Zero(local);
  kernel.AddTangent(s->jet.rate, e, local);
  if (e1 != nullptr) kernel.AddTangent(s->jet.value, e1, local);
  kernel.ToRoot(*s, local, s1);
  kernel.Zero(turned);
  kernel.AddAdjoint(s->twist.data(), s0, turned);
  kernel.Zero(twice);  // 2 S' - ad_V S
  kernel.Accumulate(2.0, s1, twice);
  kernel.Accumulate(1.0, turned, twice);
  kernel.Accumulate(1.0, turned, s1);

  kernel.Zero(local);
  kernel.AddTangent(s->jet.second, e, local);
  if (e1 != nullptr) {
    kernel.AddTangent(s->jet.rate, e1, local);
    kernel.AddTangent(s->jet.rate, e1, local);
    kernel.AddTangent(s->jet.value, e2, local);
  }
  kernel.ToRoot(*s, local, s2);
  kernel.AddAdjoint(s->twist.data(), twice, s2);
  kernel.AddAdjoint(s->acceleration.data(), s0, s2);
}

template <int C>
MANTLE_INLINE void AddFormOf(int c, const double* e, const Matrix6& a, double scale, double* out,
                             int stride) {
  const Kernel<C> kernel{C > 0 ? C : c};
  Local<C> image, scaled;
  kernel.Times6(false, false, a, e, image);
  kernel.Zero(scaled);
  kernel.Accumulate(scale, image, scaled);
  kernel.AddTransposed(e, kernel.c, scaled, out, stride);
}

template <int C>
MANTLE_INLINE void AddIntervalOf(int c, const Composite& beyond, bool needs_rotation,
                                 const double* e, const Matrix6& local, const IntervalState& s,
                                 GroupSums* g, double* mass, double* damping, double* stiffness,
                                 int stride) {
  const Kernel<C> kernel{C > 0 ? C : c};
  const int d = kernel.c;
  const double *const s0 = s.columns.data(), *const s1 = s.columns1.data(),
                      *const s2 = s.columns2.data();
  double *const sum0 = g->columns.data(), *const sum1 = g->columns1.data(),
                *const sum2 = g->columns2.data();
  Local<C> by_acceleration, twice, by_rate, by_shape, rate, rotation;
  kernel.Times6(false, false, beyond.inertia, s0, by_acceleration);
  kernel.Zero(twice);
  kernel.Accumulate(2.0, by_acceleration, twice);
  kernel.Times6(false, false, beyond.inertia, s1, by_shape);
  kernel.Times6(false, false, beyond.rate, s0, by_rate);
  kernel.Accumulate(2.0, by_shape, by_rate);
  kernel.Times6(false, false, beyond.inertia, s2, by_shape);
  kernel.Times6(true, false, beyond.rate, s1, by_shape);
  kernel.Times6(false, true, beyond.rate, s0, rate);
  if (needs_rotation) {
    kernel.Times6(true, false, beyond.rotation, s0, by_shape);
    kernel.Times6(false, true, beyond.rotation, s0, rotation);
  }
  // with the sums up to this interval, then before it
  kernel.AddTransposed(sum0, d, by_acceleration, mass, stride);
  kernel.AddTransposed(sum0, d, by_rate, damping, stride);
  kernel.AddTransposed(s0, d, by_shape, stiffness, stride);
  kernel.Accumulate(-1.0, s0, sum0);
  kernel.Accumulate(-1.0, s1, sum1);
  kernel.Accumulate(-1.0, s2, sum2);
  // Tests before feel the wrenches beyond turn with the section: -N(W) S.
  double turn[6];
  for (int i = 0; i < 6; ++i) turn[i] = -s.wrench(i);
  kernel.AddCross(turn, s0, by_shape);
  kernel.AddCross(turn + 3, s0 + 3 * d, by_shape);
  kernel.AddCross(turn + 3, s0, by_shape + 3 * d);
  kernel.AddTransposed(by_acceleration, d, sum0, mass, stride);
  kernel.AddTransposed(twice, d, sum1, damping, stride);
  kernel.AddTransposed(rate, d, sum0, damping, stride);
  kernel.AddTransposed(sum0, d, by_shape, stiffness, stride);
  kernel.AddTransposed(by_acceleration, d, sum2, stiffness, stride);
  kernel.AddTransposed(rate, d, sum1, stiffness, stride);
  if (needs_rotation) kernel.AddTransposed(rotation, d, sum0, stiffness, stride);
  kernel.Accumulate(1.0, by_acceleration, g->mass.data());
  kernel.Accumulate(1.0, by_rate, g->damping.data());
  kernel.Accumulate(1.0, by_shape, g->stiffness.data());
  kernel.Accumulate(1.0, rate, g->rate.data());
  if (needs_rotation) kernel.Accumulate(1.0, rotation, g->rotation.data());
  AddFormOf<C>(d, e, local, 1.0, stiffness, stride);
}

template <int C>
MANTLE_INLINE void CoupleGroupsOf(int p, const GroupSums& earlier, int c, const GroupSums& group,
                                  bool needs_rotation, const GroupBlocks& upper,
                                  const GroupBlocks& lower, int stride) {
  const double *const e0 = earlier.columns.data(), *const e1 = earlier.columns1.data(),
                      *const e2 = earlier.columns2.data();
  const double *const m = group.mass.data(), *const y = group.rate.data();
  const Kernel<C> row{C > 0 ? C : p}, column{C > 0 ? C : c};
  row.AddTransposed(e0, column.c, m, upper.mass, stride);
  row.AddTransposed(e0, column.c, group.damping.data(), upper.damping, stride);
  row.AddTransposed(e0, column.c, group.stiffness.data(), upper.stiffness, stride);
  column.AddTransposed(m, row.c, e0, lower.mass, stride);
  column.AddTransposed(m, row.c, e1, lower.damping, stride);
  column.AddTransposed(m, row.c, e1, lower.damping, stride);
  column.AddTransposed(y, row.c, e0, lower.damping, stride);
  column.AddTransposed(m, row.c, e2, lower.stiffness, stride);
  column.AddTransposed(y, row.c, e1, lower.stiffness, stride);
  if (needs_rotation) {
    column.AddTransposed(group.rotation.data(), row.c, e0, lower.stiffness, stride);
  }
}

}  // namespace

// The usual number of columns as a constant, so that a row is a register.

MANTLE_VECTOR_CLONES void MakeColumns(int count, const double* e, const double* e1,
                                      const double* e2, IntervalState* s) {
  if (count == 4) return MakeColumnsOf<4>(count, e, e1, e2, s);
  MakeColumnsOf<0>(count, e, e1, e2, s);
}

MANTLE_VECTOR_CLONES void AddInterval(int count, const Composite& beyond, bool needs_rotation,
                                      const double* e, const Matrix6& local, const IntervalState& s,
                                      GroupSums* group, double* mass, double* damping,
                                      double* stiffness, int stride) {
  if (count == 4) {
    return AddIntervalOf<4>(count, beyond, needs_rotation, e, local, s, group, mass, damping,
                            stiffness, stride);
  }
  AddIntervalOf<0>(count, beyond, needs_rotation, e, local, s, group, mass, damping, stiffness,
                   stride);
}

MANTLE_VECTOR_CLONES void AddForm(int count, const double* e, const Matrix6& a, double scale,
                                  double* out, int stride) {
  if (count == 4) return AddFormOf<4>(count, e, a, scale, out, stride);
  AddFormOf<0>(count, e, a, scale, out, stride);
}

MANTLE_VECTOR_CLONES void CoupleGroups(int earlier_count, const GroupSums& earlier, int count,
                                       const GroupSums& group, bool needs_rotation,
                                       const GroupBlocks& upper, const GroupBlocks& lower,
                                       int stride) {
  if (count == 4 && earlier_count == 4) {
    return CoupleGroupsOf<4>(earlier_count, earlier, count, group, needs_rotation, upper, lower,
                             stride);
  }
  CoupleGroupsOf<0>(earlier_count, earlier, count, group, needs_rotation, upper, lower, stride);
}

}  // namespace mantle::reduced
