#include "reduced/dense.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "reduced/row.h"

namespace mantle::reduced {
namespace {

// x[from, to) += f y[from, to), in whole lanes
MANTLE_INLINE void AddColumn(int from, int to, double f, const double* y, double* x) {
  for (int i = from / kLanes * kLanes; i < to; i += kLanes) {
    Row<kLanes> rows;
    rows.Load(x + i);
    rows.Add(f, y + i);
    rows.Store(x + i);
  }
}

MANTLE_VECTOR_CLONES void FactorColumns(int n, int stride, double* upper, double* lower,
                                        double* inverse, int* pivot) {
  for (int k = 0; k < n; ++k) {
    double *const own = upper + k * stride, *const column = lower + k * stride;
    int p = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(own[i]) > std::abs(own[p])) p = i;
    }
    pivot[k] = p;
    if (p != k) {
      for (int j = 0; j < k; ++j) std::swap(lower[k + j * stride], lower[p + j * stride]);
      for (int j = k; j < n; ++j) std::swap(upper[k + j * stride], upper[p + j * stride]);
    }
    inverse[k] = 1.0 / own[k];
    for (int i = 0; i <= k; ++i) column[i] = 0.0;
    for (int i = k + 1; i < n; ++i) {
      column[i] = own[i] * inverse[k];
      own[i] = 0.0;
    }
    for (int j = k + 1; j < n; ++j) {
      AddColumn(k + 1, n, -upper[k + j * stride], column, upper + j * stride);
    }
  }
}

MANTLE_VECTOR_CLONES void SolveVector(int n, int stride, const double* upper, const double* lower,
                                      const double* inverse, double* x) {
  for (int k = 0; k < n; ++k) AddColumn(k + 1, n, -x[k], lower + k * stride, x);
  for (int k = n - 1; k >= 0; --k) {
    const double f = inverse[k] * x[k];
    AddColumn(0, k, -f, upper + k * stride, x);
    x[k] = f;
  }
}

MANTLE_VECTOR_CLONES void SolvePanel(int n, std::ptrdiff_t stride, const double* upper,
                                     const double* lower, const double* inverse,
                                     std::ptrdiff_t columns, double* x) {
  for (std::ptrdiff_t c = 0; c < columns; c += kPanelWidth) {
    double* const block = x + c;
    for (int i = 1; i < n; ++i) {
      Row<kPanelWidth> sum;
      sum.Load(block + i * columns);
      const double *l = lower + i, *other = block;
      for (int k = 0; k < i; ++k, l += stride, other += columns) sum.Add(-*l, other);
      sum.Store(block + i * columns);
    }
    for (int i = n - 1; i >= 0; --i) {
      Row<kPanelWidth> sum;
      sum.Load(block + i * columns);
      const double *u = upper + i + (i + 1) * stride, *other = block + (i + 1) * columns;
      for (int k = i + 1; k < n; ++k, u += stride, other += columns) sum.Add(-*u, other);
      sum.Scale(inverse[i]);
      sum.Store(block + i * columns);
    }
  }
}

MANTLE_VECTOR_CLONES void AddPanelProduct(int rows, int inner, std::ptrdiff_t columns,
                                          std::ptrdiff_t stride, const double* a, const double* b,
                                          double* c) {
  for (std::ptrdiff_t at = 0; at < columns; at += kPanelWidth) {
    for (int i = 0; i < rows; ++i) {
      Row<kPanelWidth> sum;
      sum.Load(c + at + i * columns);
      const double *f = a + i, *other = b + at;
      for (int k = 0; k < inner; ++k, f += stride, other += columns) sum.Add(*f, other);
      sum.Store(c + at + i * columns);
    }
  }
}

}  // namespace

DenseLu::DenseLu(int n)
    : n_(n),
      stride_(Padded(n)),
      lower_(static_cast<std::size_t>(stride_) * n, 0.0),
      upper_(lower_),
      inverse_(n, 1.0),
      vector_(stride_, 0.0),
      pivot_(n, 0) {}

void DenseLu::Factor(const Eigen::MatrixXd& a) {
  assert(a.rows() == n_ && a.cols() == n_);
  for (int j = 0; j < n_; ++j) std::copy_n(&a(0, j), n_, &upper_[j * stride_]);
  FactorColumns(n_, stride_, upper_.data(), lower_.data(), inverse_.data(), pivot_.data());
}

void DenseLu::Solve(Eigen::VectorXd* x) {
  assert(x->size() == n_);
  double* const v = vector_.data();
  std::copy_n(x->data(), n_, v);
  for (int k = 0; k < n_; ++k) std::swap(v[k], v[pivot_[k]]);
  SolveVector(n_, stride_, upper_.data(), lower_.data(), inverse_.data(), v);
  std::copy_n(v, n_, x->data());
}

void DenseLu::Solve(Panel* x) const {
  assert(x->rows() == n_ && x->cols() % kPanelWidth == 0);
  for (int k = 0; k < n_; ++k) {
    if (pivot_[k] != k) x->row(k).swap(x->row(pivot_[k]));
  }
  SolvePanel(n_, stride_, upper_.data(), lower_.data(), inverse_.data(), x->cols(), x->data());
}

void AddProduct(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Panel>& b,
                Eigen::Ref<Panel> c) {
  assert(a.cols() == b.rows() && a.rows() == c.rows() && b.cols() == c.cols());
  assert(b.cols() % kPanelWidth == 0 && b.outerStride() == b.cols() && c.outerStride() == c.cols());
  AddPanelProduct(static_cast<int>(a.rows()), static_cast<int>(a.cols()), c.cols(), a.outerStride(),
                  a.data(), b.data(), c.data());
}

}  // namespace mantle::reduced
