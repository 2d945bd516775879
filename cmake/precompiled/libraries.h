// Precompiled for the libraries: what most of their files include. A file still names each header
// it uses; the presets with sanitizers build without this.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

// Classes that every file would instantiate again.
static_assert(sizeof(Eigen::Matrix<double, 6, 6>) > 0 && sizeof(Eigen::Matrix<double, 6, 1>) > 0 &&
              sizeof(Eigen::Matrix3d) > 0 && sizeof(Eigen::Vector3d) > 0 &&
              sizeof(Eigen::MatrixXd) > 0 && sizeof(Eigen::VectorXd) > 0 &&
              sizeof(Eigen::Quaterniond) > 0 && sizeof(std::vector<double>) > 0 &&
              sizeof(std::vector<std::string>) > 0);
