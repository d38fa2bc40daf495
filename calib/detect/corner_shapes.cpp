#include "calib/detect/corner_shapes.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/detect/shape_fit.h"

namespace flash::calib {
namespace {

constexpr double kSharpest = 0.2;  // blur of an edge below that of a pixel's own width [px]
constexpr double kBluntest = 6;    // [px]
constexpr double kContrast = 8;    // least difference of brightness that counts as an edge, of 255
constexpr double kBowEvidence =
    25;                          // gain in squared error a bend must show, in those of a pixel: five sigma
constexpr double kMisfit = 0.2;  // largest rms left over, as a share of the contrast

double erf_step(double distance, double blur) { return std::erf(distance / (std::sqrt(2.0) * blur)); }

double blur_of(double parameter) { return std::clamp(std::abs(parameter), kSharpest, kBluntest); }

/// Pixels whose rectified place lies within a box and passes a test.
template <class Test>
std::vector<Sample> samples_near(const GreyImage& image, const Rectifier& rectifier,
                                 const Eigen::Vector2d& centre, double reach, const Test& inside) {
  std::vector<Sample> samples;
  const Eigen::Vector2d pixel = rectifier.distorted(centre);
  // Half as much again: the lens may draw things larger than the rectified picture has them.
  const int x0 = std::max(0, static_cast<int>(std::floor(pixel.x() - 1.5 * reach)));
  const int y0 = std::max(0, static_cast<int>(std::floor(pixel.y() - 1.5 * reach)));
  const int x1 = std::min(image.width - 1, static_cast<int>(std::ceil(pixel.x() + 1.5 * reach)));
  const int y1 = std::min(image.height - 1, static_cast<int>(std::ceil(pixel.y() + 1.5 * reach)));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Eigen::Vector2d place = rectifier.at(x, y);
      if (inside(place)) samples.push_back({place, static_cast<double>(image.at(x, y))});
    }
  return samples;
}

std::vector<Sample> disc(const GreyImage& image, const Rectifier& rectifier, const Eigen::Vector2d& centre,
                         double radius) {
  return samples_near(image, rectifier, centre, radius, [&](const Eigen::Vector2d& place) {
    return (place - centre).squaredNorm() < radius * radius;
  });
}

/// A disc that the edge of the picture cuts pulls the fit to one side.
bool whole_disc(const Rectifier& rectifier, const Eigen::Vector2d& centre, double radius) {
  const Eigen::Vector2d pixel = rectifier.distorted(centre);
  return pixel.x() - radius >= 0 && pixel.y() - radius >= 0 && pixel.x() + radius <= rectifier.width() - 1 &&
         pixel.y() + radius <= rectifier.height() - 1;
}

/// The edge of one side of a marker: straight, or bent as the paper is.
struct Side {
  Eigen::Vector2d middle, along, across;
  double half;         ///< length of the part that was fitted [px]
  double first, last;  ///< offsets across at its ends [px]
  double bow = 0;      ///< offset of the middle from the line between the ends [px]

  /// The tangent where a point lies along the side, a x + b y + c = 0.
  Eigen::Vector3d tangent(const Eigen::Vector2d& point) const {
    const double t = (point - middle).dot(along) / half;
    const double offset = (first * (1 - t) + last * (1 + t)) / 2 + bow * (1 - t * t);
    const double slope = (last - first) / 2 - 2 * bow * t;
    const Eigen::Vector2d place = middle + t * half * along + offset * across;
    const Eigen::Vector2d direction = half * along + slope * across;
    return place.homogeneous().cross((place + direction).homogeneous());
  }
};

/// Of the side from p to q, with the inside of the marker on the right of it.
std::optional<Side> fit_side(const GreyImage& image, const Rectifier& rectifier, const Eigen::Vector2d& p,
                             const Eigen::Vector2d& q, double inside, double outside, double ends) {
  using Vector = Eigen::Matrix<double, 8, 1>;
  Side side;
  side.middle = (p + q) / 2;
  side.along = (q - p).normalized();
  side.across = {-side.along.y(), side.along.x()};
  side.half = (q - p).norm() / 2 - ends;
  if (side.half < 2) return std::nullopt;
  const auto split = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector2d offset = place - side.middle;
    return Eigen::Vector2d(offset.dot(side.along) / side.half, offset.dot(side.across));
  };
  const std::vector<Sample> samples =
      samples_near(image, rectifier, side.middle, side.half + std::max(inside, outside),
                   [&](const Eigen::Vector2d& place) {
                     const Eigen::Vector2d t = split(place);
                     return std::abs(t[0]) <= 1 && t[1] >= -inside && t[1] <= outside;
                   });
  // Offsets of the edge at both ends, blur, brightness on either side at both ends, bow.
  const auto bent = [&](const Vector& x, const Eigen::Vector2d& place) {
    const Eigen::Vector2d t = split(place);
    const double u = (1 + t[0]) / 2;
    const double edge = (1 - u) * x[0] + u * x[1] + x[7] * (1 - t[0] * t[0]);
    const double low = (1 - u) * x[3] + u * x[4], high = (1 - u) * x[5] + u * x[6];
    return 0.5 * (low + high) + 0.5 * (high - low) * erf_step(t[1] - edge, blur_of(x[2]));
  };
  const auto straight = [&](const Eigen::Matrix<double, 7, 1>& x, const Eigen::Vector2d& place) {
    return bent((Vector() << x, 0).finished(), place);
  };
  double low = 0, high = 0;
  int lows = 0, highs = 0;
  for (const Sample& sample : samples) {
    const bool beyond = split(sample.place)[1] > 0;
    (beyond ? high : low) += sample.value;
    ++(beyond ? highs : lows);
  }
  if (lows < 8 || highs < 8) return std::nullopt;
  low /= lows;
  high /= highs;
  Eigen::Matrix<double, 7, 1> start, scales;
  start << 0, 0, 1, low, low, high, high;
  scales << 0.1, 0.1, 0.1, 5, 5, 5, 5;
  const ShapeFit<7> line = fit_shape<7>(straight, start, scales, samples);
  Vector x = (Vector() << line.parameters, 0).finished();
  double rms = line.rms;
  // Paper bends, but a bow that is not there makes the corners twice as unsure: only where it is plain.
  const ShapeFit<8> curve = fit_shape<8>(bent, x, (Vector() << scales, 0.1).finished(), samples);
  if (line.rms * line.rms >
      curve.rms * curve.rms * (1 + kBowEvidence / static_cast<double>(samples.size()))) {
    x = curve.parameters;
    rms = curve.rms;
  }
  const double contrast = std::abs((x[5] + x[6] - x[3] - x[4]) / 2);
  const double within = std::min(inside, outside);
  if (!x.allFinite() || contrast < kContrast || rms > kMisfit * contrast || std::abs(x[0]) > within ||
      std::abs(x[1]) > within || std::abs(x[7]) > within)
    return std::nullopt;
  side.first = x[0];
  side.last = x[1];
  side.bow = x[7];
  return side;
}

}  // namespace

std::optional<Eigen::Vector2d> fit_crossing(const GreyImage& image, const Rectifier& rectifier,
                                            const Eigen::Vector2d& seed, const Eigen::Vector2d& along_x,
                                            const Eigen::Vector2d& along_y, double radius) {
  using Vector = Eigen::Matrix<double, 7, 1>;
  // Place, directions of the two lines, blur, mean brightness, half the contrast.
  const auto model = [](const Vector& x, const Eigen::Vector2d& place) {
    const double dx = place.x() - x[0], dy = place.y() - x[1], blur = blur_of(x[4]);
    return x[5] + x[6] * erf_step(-std::sin(x[2]) * dx + std::cos(x[2]) * dy, blur) *
                      erf_step(-std::sin(x[3]) * dx + std::cos(x[3]) * dy, blur);
  };
  Vector scales;
  scales << 0.1, 0.1, 0.02, 0.02, 0.1, 5, 5;
  Eigen::Vector2d centre = seed;
  Vector x;
  x << seed, std::atan2(along_x.y(), along_x.x()), std::atan2(along_y.y(), along_y.x()), 1, 0, 1;
  bool has_levels = false;
  // The disc follows the crossing: a corner off its middle sees more of one square than of another.
  for (int round = 0; round < 4; ++round) {
    if (!whole_disc(rectifier, centre, radius)) return std::nullopt;
    const std::vector<Sample> samples = disc(image, rectifier, centre, radius);
    if (!has_levels) {
      // Brightness is linear in the mean and the contrast.
      Vector pattern = x;
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
      Eigen::Vector2d right = Eigen::Vector2d::Zero();
      for (const Sample& sample : samples) {
        const Eigen::Vector2d row(1, model(pattern, sample.place));
        normal += row * row.transpose();
        right += row * sample.value;
      }
      x.tail<2>() = normal.ldlt().solve(right);
      has_levels = true;
    }
    const ShapeFit<7> fit = fit_shape<7>(model, x, scales, samples);
    x = fit.parameters;
    if (!x.allFinite() || (x.head<2>() - seed).norm() > radius) return std::nullopt;
    if (std::abs(x[6]) < kContrast / 2 || fit.rms > 2 * kMisfit * std::abs(x[6])) return std::nullopt;
    const double moved = (x.head<2>() - centre).norm();
    centre = x.head<2>();
    if (moved < 0.3) break;
  }
  // Lines that have turned onto each other show an edge, no crossing.
  if (std::abs(std::sin(x[2] - x[3])) < 0.1) return std::nullopt;
  return centre;
}

std::optional<Quad> fit_quad(const GreyImage& image, const Rectifier& rectifier, const Quad& seed,
                             double inside, double outside) {
  Quad quad = seed;
  for (int round = 0; round < 2; ++round) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : quad) middle += corner / 4;
    std::array<Side, 4> sides;
    for (std::size_t i = 0; i < 4; ++i) {
      Eigen::Vector2d p = quad[i], q = quad[(i + 1) % 4];
      const Eigen::Vector2d along = (q - p).normalized(), across(-along.y(), along.x());
      if (across.dot((p + q) / 2 - middle) < 0) std::swap(p, q);
      // Bands are a share of the side seen across, which a slanted view narrows.
      const double depth = 2 * std::abs(across.dot((p + q) / 2 - middle));
      const double in = std::clamp(inside * depth - 1, 1.5, 5.0),
                   out = std::clamp(outside * depth - 1, 1.5, 5.0);
      const std::optional<Side> side =
          fit_side(image, rectifier, p, q, in, out, std::max(2.0, std::min(in, out)));
      if (!side) return std::nullopt;
      sides[i] = *side;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      Eigen::Vector2d corner = quad[i];
      for (int step = 0; step < 4; ++step) {
        const Eigen::Vector3d crossing = sides[(i + 3) % 4].tangent(corner).cross(sides[i].tangent(corner));
        if (std::abs(crossing.z()) < 1e-12) return std::nullopt;
        corner = crossing.hnormalized();
      }
      if (!((corner - seed[i]).norm() < 5)) return std::nullopt;
      quad[i] = corner;
    }
  }
  return quad;
}

std::optional<Dot> fit_dot(const GreyImage& image, const Rectifier& rectifier, const Eigen::Vector2d& seed,
                           double reach) {
  using Vector = Eigen::Matrix<double, 10, 1>;
  // Centre, a lower triangle L with |L^T d| = 1 on the rim, blur, brightness inside and step to the outside,
  // slope.
  const auto model = [&](const Vector& x, const Eigen::Vector2d& place) {
    const Eigen::Vector2d d = place - x.head<2>();
    const double u = x[2] * d.x() + x[3] * d.y(), v = x[4] * d.y();
    const double f = std::sqrt(u * u + v * v) + 1e-9;
    const double slope = std::hypot(x[2] * u, x[3] * u + x[4] * v) / f + 1e-9;
    return x[6] + 0.5 * x[7] * (1 + erf_step((f - 1) / slope, blur_of(x[5]))) + x[8] * d.x() + x[9] * d.y();
  };
  if (!whole_disc(rectifier, seed, reach)) return std::nullopt;
  Vector x, scales;
  const std::vector<Sample> samples = disc(image, rectifier, seed, reach);
  if (samples.size() < 20) return std::nullopt;
  double dark = 255, bright = 0;
  for (const Sample& sample : samples) {
    dark = std::min(dark, sample.value);
    bright = std::max(bright, sample.value);
  }
  const auto darker = std::count_if(samples.begin(), samples.end(),
                                    [&](const Sample& sample) { return 2 * sample.value < dark + bright; });
  const double share = static_cast<double>(darker) / static_cast<double>(samples.size());
  const double radius = std::max(1.0, reach * std::sqrt(share));
  x << seed, 1 / radius, 0, 1 / radius, 1, dark, bright - dark, 0, 0;
  scales << 0.1, 0.1, 0.05 / radius, 0.05 / radius, 0.05 / radius, 0.1, 5, 5, 0.5, 0.5;
  const ShapeFit<10> fit = fit_shape<10>(model, x, scales, samples);
  x = fit.parameters;
  if (!x.allFinite() || (x.head<2>() - seed).norm() > radius || x[7] < kContrast || fit.rms > kMisfit * x[7])
    return std::nullopt;
  const double area = M_PI / std::abs(x[2] * x[4]);
  if (!(area < M_PI * reach * reach)) return std::nullopt;
  return Dot{x.head<2>(), area};
}

Eigen::Vector2d circle_image_centre(const Eigen::Matrix3d& homography, const Eigen::Vector2d& centre,
                                    double radius) {
  // The dual conic of the circle, carried over; the pole of the line at infinity is the centre.
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift.topRightCorner<2, 1>() = centre;
  const Eigen::Matrix3d H = homography * shift;
  const Eigen::Matrix3d dual =
      H * Eigen::Vector3d(radius * radius, radius * radius, -1).asDiagonal() * H.transpose();
  return dual.col(2).hnormalized();
}

}  // namespace flash::calib
