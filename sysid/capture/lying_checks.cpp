#include "sysid/capture/lying_checks.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "data/files/text.h"
#include "sysid/capture/unrolled_cloth.h"

namespace flash::sysid {
namespace {

constexpr std::size_t fewest_clouds = 3;  // of the first of a lift
constexpr std::size_t fewest_lying = 50;  // points of the lying sheet; else it is stray points that show

std::string degrees(double angle) {
  return data::format_short(std::round(std::remainder(angle, 2 * std::numbers::pi) * 180 / std::numbers::pi));
}

std::string millimetres(double length) { return data::format_short(std::round(1000 * length)) + " mm"; }

LyingSheet with_sides_changed(LyingSheet sheet) {
  std::swap(sheet.right, sheet.left);
  return sheet;
}

double quantile(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// What the clouds of the gripper's first stand show of the sheet that still lies, seen from above; thinned.
std::vector<Eigen::Vector2d> lying_points(const data::Recording& recording,
                                          const std::vector<data::Keyframe>& keyframes) {
  constexpr double still = 0.005;  // the gripper has not moved farther [m]
  constexpr std::size_t most = 1500;
  const data::Trajectory& trajectory = recording.trajectories.at("gripper");
  std::vector<Eigen::Vector2d> points;
  for (const data::Keyframe& keyframe : keyframes) {
    const Eigen::Vector3d moved =
        data::pose_at(trajectory, keyframe.time).translation() - trajectory.poses.front().translation();
    if (moved.norm() > still) break;
    for (Eigen::Index i = 0; i < keyframe.cloud.rows(); ++i)
      points.emplace_back(keyframe.cloud.row(i).head<2>().transpose());
  }
  const std::size_t step = 1 + points.size() / most;
  std::vector<Eigen::Vector2d> thinned;
  for (std::size_t i = 0; i < points.size(); i += step) thinned.push_back(points[i]);
  return thinned;
}

/// A cloud of the first frames, seen from above, and the tool that holds it.
struct FirstCloud {
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d tool = Eigen::Vector2d::Zero();
};

std::vector<FirstCloud> first_clouds(const data::Recording& recording,
                                     const std::vector<data::Keyframe>& keyframes, const LyingSheet& sheet) {
  const double farthest = 0.5 * std::min(sheet.right, sheet.left);
  constexpr Eigen::Index fewest = 50;  // else it is stray points that show
  const data::RecordedGrasp& grasp = recording.grasps.front();
  const data::Trajectory& trajectory = recording.trajectories.at(grasp.gripper);
  const Eigen::Vector3d start = trajectory.poses.front().translation();
  std::vector<FirstCloud> clouds;
  for (const data::Keyframe& keyframe : keyframes) {
    const Eigen::Vector3d tool = data::pose_at(trajectory, keyframe.time).translation();
    if ((tool - start).norm() > farthest) break;
    if (keyframe.time < grasp.from || keyframe.cloud.rows() < fewest) continue;
    FirstCloud cloud{{}, tool.head<2>()};
    for (const auto point : keyframe.cloud.rowwise()) cloud.points.emplace_back(point.head<2>().transpose());
    clouds.push_back(cloud);
  }
  return clouds;
}

/// How far the clouds reach beyond the sheet, and beyond how far their tools do [m]: all but a tenth of the
/// points, in the median frame.
double reach_beyond(const LyingSheet& sheet, const std::vector<FirstCloud>& clouds) {
  std::vector<double> reaches;
  for (const FirstCloud& cloud : clouds) {
    std::vector<double> distances;
    for (const Eigen::Vector2d& point : cloud.points) distances.push_back(distance_beside(sheet, point));
    reaches.push_back(std::max(0.0, quantile(distances, 0.9) - distance_beside(sheet, cloud.tool)));
  }
  return quantile(reaches, 0.5);
}

/// Where no cloud shows the sheet before the gripper moves: whether those that show it raised lie beside the
/// stated sheet, and not beside the one whose sides are changed over.
std::vector<std::string> compare_raised(const LyingSheet& stated, const std::vector<FirstCloud>& clouds) {
  constexpr double clear = 0.01;  // below it, heading and registration decide [m]
  if (stated.right == stated.left || clouds.size() < fewest_clouds) return {};
  const double as_given = reach_beyond(stated, clouds);
  const double as_changed = reach_beyond(with_sides_changed(stated), clouds);
  if (as_given - as_changed < clear || as_changed > 0.5 * as_given) return {};
  return {"import: warning: --mesh: the first clouds of the lift reach " + millimetres(as_given) +
          " beyond the place where the sheet lies, and with the sides changed over " +
          millimetres(as_changed) +
          ": change the sides over, or name another corner with --grasp corner:I,J"};
}

/// The unrolled clouds of cloth that is raised and still reaches down to the table, about its corner.
std::vector<std::vector<Eigen::Vector2d>> raised_clouds(const data::Recording& recording,
                                                        const std::vector<data::Keyframe>& keyframes) {
  constexpr double raised = 0.03;    // of the tool: below it, its fingers hide most of the cloth [m]
  constexpr double hangs = 0.03;     // above the lowest that any cloud shows: off the table, it drapes [m]
  constexpr double off_table = 0.1;  // where no cloud shows cloth near the table [m]
  constexpr double stray = 0.02;
  const data::RecordedGrasp& grasp = recording.grasps.front();
  const data::Trajectory& trajectory = recording.trajectories.at(grasp.gripper);
  std::vector<double> lowest;
  for (const data::Keyframe& keyframe : keyframes) {
    const auto heights = keyframe.cloud.col(2);
    lowest.push_back(keyframe.cloud.rows() == 0 ? INFINITY
                                                : quantile({heights.begin(), heights.end()}, stray));
  }
  const double low = lowest.empty() ? INFINITY : *std::min_element(lowest.begin(), lowest.end());
  std::vector<std::vector<Eigen::Vector2d>> clouds;
  if (!(low < recording.table_point.z() + off_table)) return clouds;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const Eigen::Vector3d tool = data::pose_at(trajectory, keyframes[k].time).translation();
    if (keyframes[k].time < grasp.from || lowest[k] > low + hangs) continue;
    if (tool.z() < trajectory.poses.front().translation().z() + raised) continue;
    if (auto points = unrolled(keyframes[k].cloud, tool); !points.empty())
      clouds.push_back(std::move(points));
  }
  return clouds;
}

/// How far unrolled clouds reach beyond a sheet, in the mean of a frame's points and the median frame [m]:
/// least over headings of up to `slack` [rad] and places of the camera of up to `offset` about the stated.
double beyond_sheet(LyingSheet sheet, const std::vector<std::vector<Eigen::Vector2d>>& clouds, double slack,
                    const Eigen::Vector2d& offset) {
  const double heading = sheet.heading;
  double least = INFINITY;
  for (const double turn : {-1.0, -0.5, 0.0, 0.5, 1.0})
    for (const double x : {-1.0, 0.0, 1.0})
      for (const double y : {-1.0, 0.0, 1.0}) {
        sheet.heading = heading + turn * slack;
        sheet.corner = offset.cwiseProduct(Eigen::Vector2d(x, y));
        std::vector<double> means;
        for (const std::vector<Eigen::Vector2d>& cloud : clouds) {
          double sum = 0;
          for (const Eigen::Vector2d& point : cloud) sum += distance_beside(sheet, point);
          means.push_back(sum / static_cast<double>(cloud.size()));
        }
        least = std::min(least, quantile(means, 0.5));
      }
  return least;
}

/// "sheet:0.3x0.2:0.01" of "sheet:0.2x0.3:0.01".
std::string with_sides_changed(const std::string& spec) {
  const std::size_t begin = spec.find(':') + 1, end = std::min(spec.find(':', begin), spec.size());
  const std::size_t by = spec.find('x', begin);
  if (by >= end) return spec;
  return spec.substr(0, begin) + spec.substr(by + 1, end - by - 1) + 'x' + spec.substr(begin, by - begin) +
         spec.substr(end);
}

/// The longest range of headings at which the clouds reach beyond the sheet by at most `allowed`, as
/// "--heading -123 to -54"; empty where there is none.
std::string fitting_headings(LyingSheet sheet, const std::vector<FirstCloud>& clouds, double allowed) {
  constexpr int step = 3, count = 360 / step;
  std::vector<bool> fits;
  for (int k = 0; k < count; ++k) {
    sheet.heading = k * step * std::numbers::pi / 180;
    fits.push_back(reach_beyond(sheet, clouds) <= allowed);
  }
  // The longest run of them, which may go through 0.
  int longest = 0, end = 0, run = 0;
  for (int k = 0; k < 2 * count; ++k) {
    run = fits[static_cast<std::size_t>(k % count)] ? run + 1 : 0;
    if (run > longest) longest = run, end = k;
  }
  if (longest == 0 || longest >= count) return "";
  const auto angle = [&](int k) { return degrees(k * step * std::numbers::pi / 180); };
  return "--heading " + angle(end - longest + 1) + " to " + angle(end);
}

}  // namespace

std::optional<LyingSheet> stated_sheet(const data::Recording& recording, double heading) {
  const auto& corner = recording.grasps[0].select.corner;
  if (!corner || !recording.mesh_spec.starts_with("sheet:")) return std::nullopt;
  const data::Points& rest = recording.mesh.vertices;
  const Eigen::RowVector3d low = rest.colwise().minCoeff(), high = rest.colwise().maxCoeff();
  const Eigen::Vector3d place((*corner)[0] == 0 ? low.x() : high.x(), (*corner)[1] == 0 ? low.y() : high.y(),
                              low.z());
  const LyingSheet sheet{(recording.base_from_object * place).head<2>(), high.x() - low.x(),
                         high.y() - low.y(), heading};
  return (*corner)[0] == (*corner)[1] ? sheet : with_sides_changed(sheet);
}

std::string sides_taken(const LyingSheet& stated) {
  return "import: --mesh: the side on the right hand is " + millimetres(stated.right) +
         " and that on the left " + millimetres(stated.left) +
         ", from the grasped corner along the diagonal and seen from above";
}

std::string swapped_sides(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                          const LyingSheet& stated, double slack) {
  constexpr double square = 0.8;  // of the longer side: raised cloth does not tell such sides apart
  if (stated.right == stated.left) return "";
  const LyingSheet changed = with_sides_changed(stated);
  const std::string remedy = ": swap the sides, --mesh " + with_sides_changed(recording.mesh_spec) +
                             ", or name another corner with --grasp corner:I,J";
  const std::string sides = "the cloth lies with " + millimetres(changed.right) +
                            " on the right hand of its diagonal and " + millimetres(changed.left) +
                            " on the left, and --mesh says " + millimetres(stated.right) + " and " +
                            millimetres(stated.left);
  const std::vector<Eigen::Vector2d> points = lying_points(recording, keyframes);
  if (points.size() >= fewest_lying) {
    constexpr double clear = 0.002;  // below it, noise decides [m]
    const double as_given = distance_to(turned_to(stated, points), points);
    const double as_changed = distance_to(turned_to(changed, points), points);
    if (as_changed >= 0.5 * as_given || as_given - as_changed <= clear) return "";
    return sides + " (what the first clouds show of it is " + data::format_short(1000 * as_given) +
           " mm from that, and with the sides swapped " + data::format_short(1000 * as_changed) + " mm)" +
           remedy + ".";
  }
  if (std::min(stated.right, stated.left) > square * std::max(stated.right, stated.left)) return "";
  const std::vector<std::vector<Eigen::Vector2d>> clouds = raised_clouds(recording, keyframes);
  if (clouds.size() < fewest_clouds) return "";
  constexpr double clear = 0.003;  // what a fold that is no cylinder moves points by [m]
  const data::NuisanceBounds& bounds = recording.nuisance;
  const double turn = slack + bounds.yaw + bounds.start_yaw;
  const auto beyond = [&](const LyingSheet& sheet) {
    return beyond_sheet(sheet, clouds, turn, bounds.offset.head<2>());
  };
  const double as_given = beyond(stated), as_changed = beyond(changed);
  if (as_given <= clear || as_changed >= 0.4 * as_given) return "";
  const std::string beside = " (raised cloth reaches " + millimetres(as_given) + " beyond, and " +
                             millimetres(as_changed) + " with the sides swapped)";
  // A heading that is as far off as the diagonals of both are apart would do the same.
  constexpr double farthest = 45, step = 3;  // [deg]
  std::string other;
  double least = std::max(as_changed, 0.4 * as_given);
  for (double degree = -farthest; degree <= farthest; degree += step) {
    LyingSheet turned = stated;
    turned.heading += degree * std::numbers::pi / 180;
    const double reach = beyond_sheet(turned, clouds, 0, bounds.offset.head<2>());
    if (reach >= least) continue;
    least = reach;
    other = "; or is it --heading " + degrees(turned.heading) + "?";
  }
  return sides + beside + remedy + (other.empty() ? "." : other);
}

std::vector<std::string> compare_sides(const data::Recording& recording,
                                       const std::vector<data::Keyframe>& keyframes,
                                       const LyingSheet& stated) {
  const std::vector<Eigen::Vector2d> points = lying_points(recording, keyframes);
  if (points.size() < fewest_lying) return compare_raised(stated, first_clouds(recording, keyframes, stated));
  const LyingSheet fitted = turned_to(stated, points);
  constexpr double good = 0.008;  // what a cloud of 10 mm between its points is from its sheet [m]
  const double turn = (fitted.heading - stated.heading) * 180 / std::numbers::pi;
  if (distance_to(fitted, points) > good || std::abs(turn) < 1.5) return {};
  return {"import: what the first clouds show of the lying sheet fits best with --heading " +
          degrees(fitted.heading)};
}

std::string beside_the_sheet(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                             const LyingSheet& stated) {
  constexpr double known = 0.015;  // of the clouds, and the corner in the fingers [m]
  const std::vector<FirstCloud> clouds = first_clouds(recording, keyframes, stated);
  if (clouds.size() < fewest_clouds) return "";
  const data::NuisanceBounds& bounds = recording.nuisance;
  const double allowed = known + bounds.offset.head<2>().norm() +
                         (bounds.yaw + bounds.start_yaw) * std::min(stated.right, stated.left);
  const double reach = reach_beyond(stated, clouds);
  if (reach <= allowed) return "";

  const LyingSheet changed = with_sides_changed(stated);
  std::string fits;
  if (stated.right != stated.left && reach_beyond(changed, clouds) <= allowed)
    fits = "the sides changed over or another --grasp corner:I,J";
  if (const std::string headings = fitting_headings(stated, clouds, allowed); !headings.empty())
    fits += (fits.empty() ? "" : ", or ") + headings + " (degrees)";
  return "the first clouds of the lift reach " + millimetres(reach) +
         " beyond the place where the sheet lies by --mesh, --grasp and --heading " +
         degrees(stated.heading) + ", expected at most " + millimetres(allowed) +
         (fits.empty() ? ": are the sides, the corner and the heading right?"
                       : ": they fit with " + fits + ".");
}

}  // namespace flash::sysid
