#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <string>
#include <vector>

/// @file
/// Between Eigen and NumPy. A view shares its numbers with the C++ object behind it, keeps alive
/// the Python object that owns them, and cannot be written unless it says so. Columns of an Eigen
/// matrix are rows of the array: a 3 x n matrix of places is seen as an array of shape (n, 3).

namespace mantle::python {

namespace py = pybind11;

/// Numbers that a caller gives: anything that NumPy makes doubles of.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A view of doubles that lie one behind the other.
py::array View(const double* data, std::vector<py::ssize_t> shape, py::handle owner,
               bool writable = false);

/// A view of a matrix that keeps its storage, each of its columns a row.
template <typename Matrix>
py::array RowsView(const Matrix& matrix, py::handle owner) {
  return View(matrix.data(), {matrix.cols(), matrix.rows()}, owner);
}

/// A new array with the numbers of a vector or matrix, in its own shape.
py::array_t<double> CopyMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
py::array_t<double> Copy(const Eigen::Ref<const Eigen::VectorXd>& vector);

/// `numbers` as a vector of `size` finite entries. Throws tools::BadInput that begins with `what`.
Eigen::VectorXd VectorOf(const std::string& what, const Numbers& numbers, Eigen::Index size);

}  // namespace mantle::python
