#include "calib/report/overlay.h"

#include <algorithm>
#include <cmath>

namespace flash::calib {
namespace {

constexpr data::Colour kGreen = {40, 220, 60}, kRed = {255, 50, 40}, kYellow = {255, 210, 0};

void dot(data::Picture& picture, const Eigen::Vector2d& place, const data::Colour& colour) {
  const int x = static_cast<int>(std::lround(place.x())), y = static_cast<int>(std::lround(place.y()));
  if (x >= 0 && y >= 0 && x < picture.width && y < picture.height) picture.at(x, y) = colour;
}

void line(data::Picture& picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
          const data::Colour& colour) {
  const double length = (to - from).norm();
  // A residual that is far off may point out of any picture.
  const int steps = static_cast<int>(std::min(length, 4.0 * picture.width)) * 2 + 1;
  for (int i = 0; i <= steps; ++i)
    dot(picture, from + (to - from) * (static_cast<double>(i) / steps), colour);
}

void ring(data::Picture& picture, const Eigen::Vector2d& centre, double radius, const data::Colour& colour) {
  const int steps = static_cast<int>(8 * radius) + 8;
  for (int i = 0; i < steps; ++i) {
    const double angle = 2 * M_PI * i / steps;
    dot(picture, centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)), colour);
  }
}

/// Between the four pixels around; the nearest beyond the edge.
double brightness(const GreyImage& image, const Eigen::Vector2d& place) {
  const double x = std::clamp(place.x(), 0.0, image.width - 1.001),
               y = std::clamp(place.y(), 0.0, image.height - 1.001);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const double u = x - x0, v = y - y0;
  return (1 - v) * ((1 - u) * image.at(x0, y0) + u * image.at(x0 + 1, y0)) +
         v * ((1 - u) * image.at(x0, y0 + 1) + u * image.at(x0 + 1, y0 + 1));
}

}  // namespace

data::Picture corner_picture(const GreyImage& image, const Eigen::Matrix2Xd& detected,
                             const Eigen::Matrix2Xd& projected, const CornerPictureSettings& settings) {
  Eigen::Vector2d low(0, 0), high(image.width, image.height);
  if (detected.cols() > 0) {
    low = detected.rowwise().minCoeff();
    high = detected.rowwise().maxCoeff();
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(settings.margin * (high - low).maxCoeff() + 4);
    low = (low - margin).cwiseMax(0);
    high = (high + margin).cwiseMin(Eigen::Vector2d(image.width, image.height));
  }
  const double scale = settings.width / (high.x() - low.x());
  const int height = std::clamp(static_cast<int>(scale * (high.y() - low.y())), 1, 4 * settings.width);
  data::Picture picture(settings.width, height, {0, 0, 0});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < settings.width; ++x) {
      const Eigen::Vector2d place = low + Eigen::Vector2d(x, y) / scale;
      const auto value = static_cast<std::uint8_t>(std::clamp(brightness(image, place), 0.0, 255.0));
      picture.at(x, y) = {value, value, value};
    }
  const auto to_picture = [&](const Eigen::Vector2d& pixel) -> Eigen::Vector2d {
    return scale * (pixel - low);
  };
  for (Eigen::Index i = 0; i < detected.cols(); ++i) {
    const Eigen::Vector2d seen = to_picture(detected.col(i));
    ring(picture, seen, 5, kGreen);
    ring(picture, seen, 5.5, kGreen);
    if (i >= projected.cols()) continue;
    const Eigen::Vector2d expected = to_picture(projected.col(i));
    line(picture, seen, seen + settings.magnified * (expected - seen), kYellow);
    for (const Eigen::Vector2d& arm : {Eigen::Vector2d(3, 3), Eigen::Vector2d(3, -3)})
      line(picture, expected - arm, expected + arm, kRed);
  }
  return picture;
}

}  // namespace flash::calib
