#include "tools/studies/order_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace mantle::tools {
namespace {

constexpr double kLowestOrder = 0.2, kHighestOrder = 8.0, kOrderStep = 0.005;
constexpr std::size_t kFewest = 3;

// Best constant for a given order, and how far the points scatter about it.
OrderFit FitConstant(std::span<const ConvergencePoint> points, double reference, double order) {
  double mean = 0;
  std::vector<double> logs;
  for (const ConvergencePoint& p : points) {
    const double power = std::pow(p.size, order) - std::pow(reference, order);
    logs.push_back(std::log(p.error / power));
    mean += logs.back();
  }
  mean /= static_cast<double>(points.size());
  double squares = 0;
  for (double x : logs) squares += (x - mean) * (x - mean);
  OrderFit fit;
  fit.order = order;
  fit.constant = std::exp(mean);
  fit.points = static_cast<int>(points.size());
  fit.coarsest = points.front().size;
  fit.finest = points.back().size;
  fit.scatter = std::sqrt(squares / static_cast<double>(points.size()));
  return fit;
}

OrderFit FitAll(std::span<const ConvergencePoint> points, double reference) {
  OrderFit best;
  best.scatter = std::numeric_limits<double>::infinity();
  for (double order = kLowestOrder; order <= kHighestOrder; order += kOrderStep) {
    const OrderFit fit = FitConstant(points, reference, order);
    if (fit.scatter < best.scatter) best = fit;
  }
  return best;
}

}  // namespace

double OrderFit::SizeFor(double error) const { return std::pow(error / constant, 1.0 / order); }

std::optional<OrderFit> FitOrder(std::vector<ConvergencePoint> points, double reference_size,
                                 double floor, double ceiling) {
  std::erase_if(points, [&](const ConvergencePoint& p) {
    return !(p.size > reference_size) || !std::isfinite(p.error);
  });
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.size > b.size; });
  std::erase_if(points,
                [&](const ConvergencePoint& p) { return p.error < floor || p.error > ceiling; });
  if (points.size() < kFewest) return {};
  return FitAll(points, reference_size);
}

double LargestSizeWithin(std::vector<ConvergencePoint> points, double target) {
  std::sort(points.begin(), points.end(), [](auto a, auto b) { return a.size < b.size; });
  const ConvergencePoint* within = nullptr;
  for (const ConvergencePoint& p : points) {
    if (p.error > target) {
      if (within == nullptr || !(within->error > 0)) return within == nullptr ? 0 : within->size;
      const double share = std::log(target / within->error) / std::log(p.error / within->error);
      return within->size * std::pow(p.size / within->size, std::clamp(share, 0.0, 1.0));
    }
    within = &p;
  }
  return within == nullptr ? 0 : within->size;
}

std::vector<int> ParetoFront(std::span<const double> cost, std::span<const double> error) {
  std::vector<int> order(cost.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return cost[a] != cost[b] ? cost[a] < cost[b] : error[a] < error[b];
  });
  std::vector<int> front;
  double least = std::numeric_limits<double>::infinity();
  for (int i : order) {
    if (!std::isfinite(cost[i]) || !(error[i] < least)) continue;
    least = error[i];
    front.push_back(i);
  }
  return front;
}

}  // namespace mantle::tools
