#include "reduced/dense.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "reduced/vector_clones.h"

namespace mantle::reduced {
namespace {

constexpr int kLanes = 4;  // columns of the factors are padded to this

MANTLE_VECTOR_CLONES void FactorColumns(int n, int stride, double* a, double* inverse,
                                        double* column, int* pivot) {
  for (int k = 0; k < n; ++k) {
    double* const own = a + k * stride;
    int p = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(own[i]) > std::abs(own[p])) p = i;
    }
    pivot[k] = p;
    if (p != k) {
      for (int j = 0; j < n; ++j) std::swap(a[k + j * stride], a[p + j * stride]);
    }
    inverse[k] = 1.0 / own[k];
    // zeros above, so that the update below runs over whole lanes
    const int from = (k + 1) / kLanes * kLanes;
    for (int i = from; i <= k; ++i) column[i] = 0.0;
    for (int i = k + 1; i < n; ++i) column[i] = own[i] *= inverse[k];
    for (int j = k + 1; j < n; ++j) {
      double* const x = a + j * stride;
      const double u = x[k];
      for (int i = from; i < n; i += kLanes) {
        for (int l = 0; l < kLanes; ++l) x[i + l] -= u * column[i + l];
      }
    }
  }
}

MANTLE_VECTOR_CLONES void SolvePanel(int n, int stride, const double* a, const double* inverse,
                                     int columns, double* x) {
  for (int c = 0; c < columns; c += kPanelWidth) {
    double* const block = x + c;
    for (int i = 0; i < n; ++i) {
      double* const row = block + i * columns;
      double sum[kPanelWidth];
      for (int j = 0; j < kPanelWidth; ++j) sum[j] = row[j];
      for (int k = 0; k < i; ++k) {
        const double l = a[i + k * stride];
        const double* const other = block + k * columns;
        for (int j = 0; j < kPanelWidth; ++j) sum[j] -= l * other[j];
      }
      for (int j = 0; j < kPanelWidth; ++j) row[j] = sum[j];
    }
    for (int i = n - 1; i >= 0; --i) {
      double* const row = block + i * columns;
      double sum[kPanelWidth];
      for (int j = 0; j < kPanelWidth; ++j) sum[j] = row[j];
      for (int k = i + 1; k < n; ++k) {
        const double u = a[i + k * stride];
        const double* const other = block + k * columns;
        for (int j = 0; j < kPanelWidth; ++j) sum[j] -= u * other[j];
      }
      for (int j = 0; j < kPanelWidth; ++j) row[j] = inverse[i] * sum[j];
    }
  }
}

MANTLE_VECTOR_CLONES void AddPanelProduct(int rows, int inner, int columns, int stride,
                                          const double* a, const double* b, double* c) {
  for (int at = 0; at < columns; at += kPanelWidth) {
    for (int i = 0; i < rows; ++i) {
      double* const row = c + at + i * columns;
      double sum[kPanelWidth];
      for (int j = 0; j < kPanelWidth; ++j) sum[j] = row[j];
      for (int k = 0; k < inner; ++k) {
        const double f = a[i + k * stride];
        const double* const other = b + at + k * columns;
        for (int j = 0; j < kPanelWidth; ++j) sum[j] += f * other[j];
      }
      for (int j = 0; j < kPanelWidth; ++j) row[j] = sum[j];
    }
  }
}

}  // namespace

DenseLu::DenseLu(int n)
    : n_(n),
      stride_((n + kLanes - 1) / kLanes * kLanes),
      lu_(static_cast<std::size_t>(stride_) * n, 0.0),
      inverse_(n, 1.0),
      column_(stride_, 0.0),
      pivot_(n, 0) {}

void DenseLu::Factor(const Eigen::MatrixXd& a) {
  assert(a.rows() == n_ && a.cols() == n_);
  for (int j = 0; j < n_; ++j) {
    for (int i = 0; i < n_; ++i) lu_[i + j * stride_] = a(i, j);
  }
  FactorColumns(n_, stride_, lu_.data(), inverse_.data(), column_.data(), pivot_.data());
}

void DenseLu::Solve(Eigen::VectorXd* x) const {
  assert(x->size() == n_);
  double* const v = x->data();
  for (int k = 0; k < n_; ++k) std::swap(v[k], v[pivot_[k]]);
  for (int k = 0; k < n_; ++k) {
    const double* const column = lu_.data() + k * stride_;
    const double f = v[k];
    for (int i = k + 1; i < n_; ++i) v[i] -= f * column[i];
  }
  for (int k = n_ - 1; k >= 0; --k) {
    const double* const column = lu_.data() + k * stride_;
    const double f = v[k] *= inverse_[k];
    for (int i = 0; i < k; ++i) v[i] -= f * column[i];
  }
}

void DenseLu::Solve(Panel* x) const {
  assert(x->rows() == n_ && x->cols() % kPanelWidth == 0);
  const int columns = static_cast<int>(x->cols());
  for (int k = 0; k < n_; ++k) {
    if (pivot_[k] != k) x->row(k).swap(x->row(pivot_[k]));
  }
  SolvePanel(n_, stride_, lu_.data(), inverse_.data(), columns, x->data());
}

void AddProduct(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Panel>& b,
                Eigen::Ref<Panel> c) {
  assert(a.cols() == b.rows() && a.rows() == c.rows() && b.cols() == c.cols());
  assert(b.cols() % kPanelWidth == 0 && b.outerStride() == b.cols() && c.outerStride() == c.cols());
  AddPanelProduct(static_cast<int>(a.rows()), static_cast<int>(a.cols()),
                  static_cast<int>(c.cols()), static_cast<int>(a.outerStride()), a.data(), b.data(),
                  c.data());
}

}  // namespace mantle::reduced
