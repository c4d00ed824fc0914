#include "maze.hpp"

#include <sstream>

namespace mazes {
namespace {

constexpr double kReach = 0.45;      // m: how near to a goal reaches it
constexpr int kMostCells = 10000;    // of a map
constexpr int kMostDraws = 1000000;  // after which a reset gives up; Gymnasium-Robotics draws for ever

// Numbers as an attribute of MJCF.
template <typename... Numbers>
std::string attribute(const char* name, Numbers... numbers) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  text << ' ' << name << "=\"";
  const char* between = "";
  ((text << between << numbers, between = " "), ...);
  return text.str() + '"';
}

std::string wall(std::size_t row, std::size_t column) {
  return "block_" + std::to_string(row) + '_' + std::to_string(column);
}

}  // namespace

Map map_of(const std::string& rows) {
  std::istringstream text(rows);
  Map map;
  for (std::string row; std::getline(text, row, '/');) map.push_back(row);
  std::size_t free = 0;
  for (const std::string& row : map) {
    if (row.size() != map[0].size() || row.find_first_not_of("#.rgc") != std::string::npos)
      throw std::invalid_argument("the maze has rows of different lengths, or cells other than # . r g c");
    free += static_cast<std::size_t>(std::count_if(row.begin(), row.end(), [](char cell) { return cell != '#'; }));
  }
  if (free < 2 || rows.size() > kMostCells)
    throw std::invalid_argument("the maze has less than 2 free cells, or more than 10000 in all");
  return map;
}

Map map_option(Robot& r, const Map& otherwise) {
  const std::string rows = r.text("maze_map", "",
                                  "the maze's rows with / between them, of walls # and cells . r g c; the "
                                  "model must have these walls. Empty: the id's own maze");
  return rows.empty() ? otherwise : map_of(rows);
}

Maze::Maze(const Map& map, double width, double height) : scale(width), map_(map), height_(height) {
  std::vector<Vector2d> resets, targets, both, empty;
  for (std::size_t i = 0; i < map.size(); ++i)
    for (std::size_t j = 0; j < map[i].size(); ++j) {
      const char kind = map[i][j];
      if (kind != '#')
        (kind == 'r' ? resets : kind == 'g' ? targets : kind == 'c' ? both : empty).push_back(middle(i, j));
    }
  if (both.empty() && resets.empty() && targets.empty())
    both = empty;
  else if (both.empty() && resets.empty())
    resets = empty;
  else if (both.empty() && targets.empty())
    targets = empty;
  starts = resets, goals = targets;
  starts.insert(starts.end(), both.begin(), both.end());
  goals.insert(goals.end(), both.begin(), both.end());
}

Vector2d Maze::middle(std::size_t row, std::size_t column) const {
  const auto half = [&](std::size_t cells) { return static_cast<double>(cells) / 2 * scale; };
  const auto at = [&](std::size_t cell) { return (static_cast<double>(cell) + 0.5) * scale; };
  return {at(column) - half(map_[0].size()), half(map_.size()) - at(row)};
}

Vector2d Maze::cell(double row, double column) const {
  const auto i = static_cast<std::size_t>(row), j = static_cast<std::size_t>(column);
  if (row < 0 || column < 0 || i >= map_.size() || j >= map_[0].size() || map_[i][j] == '#')
    throw std::out_of_range("row " + std::to_string(i) + ", column " + std::to_string(j) + " is no free cell");
  return middle(i, j);
}

std::string Maze::model(const char* mjcf) const {
  const double half = height_ / 2 * scale;
  std::string added;
  for (std::size_t i = 0; i < map_.size(); ++i)
    for (std::size_t j = 0; j < map_[i].size(); ++j) {
      if (map_[i][j] != '#') continue;
      const Vector2d at = middle(i, j);
      added += "<geom name=\"" + wall(i, j) + "\" type=\"box\"" + attribute("pos", at[0], at[1], half) +
               attribute("size", 0.5 * scale, 0.5 * scale, half) +
               " contype=\"1\" conaffinity=\"1\" rgba=\"0.7 0.5 0.3 1\"/>";
    }
  added += "<site name=\"target\"" + attribute("pos", 0, 0, half) + attribute("size", 0.2 * scale) +
           " type=\"sphere\" rgba=\"1 0 0 0.7\"/>";
  std::string text = mjcf;
  return text.insert(text.find("</worldbody>"), added);
}

void Maze::check(Robot& r) const {
  for (std::size_t i = 0; i < map_.size(); ++i)
    for (std::size_t j = 0; j < map_[i].size(); ++j)
      if (map_[i][j] == '#') r.geom(wall(i, j).c_str());
}

Quest::Quest(Robot& r, const Maze& maze, bool is_dense)
    : maze_(maze),
      norm_(r.norm()),
      is_dense_(r.text("reward_type", is_dense ? "dense" : "sparse",
                       "sparse: 1 within 0.45 m of the goal, else 0; dense: exp(-distance)",
                       "sparse dense") == "dense"),
      continues_(r.flag("continuing_task", true, "an episode goes on when the goal is reached")),
      moves_goal_(r.flag("reset_target", false, "a goal that is reached moves to another cell, if the task continues")),
      noise_(
          r.real("position_noise_range", 0.25, "how far starts and goals lie from the middle of a cell, in cells", 0)),
      goal_cell_(
          r.live("goal_cell", {-1, -1}, "row and column of the cell with the goal; -1: it is drawn", -1, kMostCells)),
      reset_cell_(r.live("reset_cell", {-1, -1}, "row and column of the cell where episodes begin; -1: it is drawn", -1,
                         kMostCells)),
      site_pos_(r.own("site_pos")),
      target_(3 * r.site("target")),
      goal_(r.carry(2)),
      shown_(r.carry(2)) {
  maze_.check(r);
  r.compute_reward(
      [quest = *this](const Goal& achieved, const Goal& desired) { return quest.reward(achieved, desired); });
}

Vector2d Quest::draw(const std::vector<Vector2d>& cells, Rng& rng) const {
  return cells[static_cast<std::size_t>(rng.integers(0, static_cast<std::int64_t>(cells.size())))];
}

Vector2d Quest::noisy(Vector2d at, Rng& rng) const {
  for (double& x : at) x += rng.uniform(-noise_, noise_) * maze_.scale;
  return at;
}

bool Quest::reaches(const Vector2d& at, const Vector2d& goal) const { return norm_(Vector2d(at - goal)) <= kReach; }

double Quest::reward(const Vector2d& at, const Vector2d& goal) const {
  const double x = at[0] - goal[0], y = at[1] - goal[1], distance = std::sqrt(x * x + y * y);
  return is_dense_ ? std::exp(-distance) : distance <= kReach ? 1 : 0;
}

Vector2d Quest::begin(Start& start, Rng& rng) const {
  const auto chosen = [&](const LiveVector& cell, const auto& otherwise) {
    const auto at = start[cell];
    return at[0] < 0 ? otherwise() : maze_.cell(at[0], at[1]);
  };
  const Vector2d goal = noisy(chosen(goal_cell_, [&] { return draw(maze_.goals, rng); }), rng);
  const auto far_from_goal = [&] {
    for (int i = 0; i < kMostDraws; ++i)
      if (const Vector2d at = draw(maze_.starts, rng); norm_(Vector2d(at - goal)) > 0.5 * maze_.scale) return at;
    throw std::runtime_error("every cell where episodes begin is too near to the goal");
  };
  const Vector2d at = chosen(reset_cell_, far_from_goal);
  start[goal_] = start[shown_] = goal;
  start[site_pos_].segment<2>(target_) = goal;
  return noisy(at, rng);
}

Outcome Quest::step(const Vector2d& at, Row& row, Info& info) const {
  const Vector2d goal = row[goal_];
  const bool reached = reaches(at, goal);
  info("success", reached);
  row[shown_] = goal;
  if (continues_ && moves_goal_ && reached && maze_.goals.size() > 1) {
    Vector2d next = goal;
    for (int i = 0; reaches(at, next); ++i) {
      if (i == kMostDraws) throw std::runtime_error("every cell with a goal is too near");
      next = noisy(draw(maze_.goals, row.rng), row.rng);
    }
    row[goal_] = next;
    row[site_pos_].segment<2>(target_) = next;
  }
  return {reward(at, goal), !continues_ && reached};
}

void Quest::reset_info(const Sim& s, const Vector2d& at, Info& info) const { info("success", reaches(at, s[shown_])); }

void Quest::observe(Robot& r) const {
  r.group("desired_goal");
  r.observe("goal", [shown = shown_](const Sim& s) { return s[shown]; });
}

}  // namespace mazes

// The model of an id's robot in a maze (map_of), for the option xml_string; null if the map is none. Valid until the
// thread's next call.
extern "C" MJENV_EXPORT const char* mjenv_mazes_model(const char* id, const char* rows) noexcept {
  thread_local std::string text;
  try {
    const bool is_ant = std::string(id).find("Ant") != std::string::npos;
    text = mazes::Maze(mazes::map_of(rows), is_ant ? 4 : 1, is_ant ? 0.5 : 0.4)
               .model(is_ant ? mazes::ant_model : mazes::point_model);
    return text.c_str();
  } catch (const std::exception&) {
    return nullptr;
  }
}
