#include "python/arrays.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/mantle/bad_input.h"

namespace mantle::python {

py::array View(const double* data, std::vector<py::ssize_t> shape, py::handle owner,
               bool writable) {
  py::array_t<double> array(std::move(shape), data, owner);
  if (!writable) {
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  }
  return array;
}

py::array_t<double> CopyMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  py::array_t<double> array({matrix.rows(), matrix.cols()});
  auto to = array.mutable_unchecked<2>();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) to(i, j) = matrix(i, j);
  }
  return array;
}

py::array_t<double> Copy(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  py::array_t<double> array(vector.size());
  for (Eigen::Index i = 0; i < vector.size(); ++i) array.mutable_at(i) = vector(i);
  return array;
}

Eigen::VectorXd VectorOf(const std::string& what, const Numbers& numbers, Eigen::Index size) {
  if (numbers.ndim() != 1 || numbers.shape(0) != size) {
    std::string shape;
    for (py::ssize_t k = 0; k < numbers.ndim(); ++k) {
      shape += fmt::format("{}{}", k == 0 ? "" : ", ", numbers.shape(k));
    }
    throw tools::BadInput(fmt::format("{}: has the shape ({}), must be ({},)", what, shape, size));
  }
  Eigen::VectorXd vector(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    vector(i) = numbers.at(i);
    if (!std::isfinite(vector(i))) {
      throw tools::BadInput(fmt::format("{}: entry {} is {}, must be finite", what, i, vector(i)));
    }
  }
  return vector;
}

}  // namespace mantle::python
