// Mazes and what their tasks have in common, with the bits of Gymnasium-Robotics on NumPy without AVX-512.
#pragma once

#include <mjenv/task.hpp>
#include <string>
#include <vector>

namespace mazes {

using namespace mjenv;
using Eigen::Vector2d;

// MJCF without walls (assets/).
extern const char* const point_model;
extern const char* const ant_model;

// The rows of a maze from north to south, each from west to east: '#' is a wall, 'r' a cell where episodes begin, 'g' one
// with a goal, 'c' one for both, '.' free. Without such letters, each free cell is one for both; without 'r' and 'c',
// episodes begin in free cells, and without 'g' and 'c', goals are there.
using Map = std::vector<std::string>;

// A map from its rows with "/" between them. Throws std::invalid_argument.
Map map_of(const std::string& rows);
// The map that the option maze_map has.
Map map_option(Robot& r, const Map& otherwise);

extern const Map u_maze, open, open_g, open_gr, medium, medium_g, medium_gr, large, large_g, large_gr;

class Maze {
 public:
  // scale: the width of a cell, m. height: that of the walls, in cells.
  Maze(const Map& map, double scale, double height);

  // A model with the walls, and the site "target".
  std::string model(const char* mjcf) const;
  // Refuses a model that lacks walls.
  void check(Robot& r) const;
  // The middle of a cell. Throws if there is none, or a wall.
  Vector2d cell(double row, double column) const;

  double scale;
  std::vector<Vector2d> starts, goals;

 private:
  Map map_;
  double height_;

  Vector2d middle(std::size_t row, std::size_t column) const;
};

// A task's goal, and the reward for reaching it.
class Quest {
 public:
  // is_dense: the default of the option reward_type.
  Quest(Robot& r, const Maze& maze, bool is_dense);

  // Draws the goal and where the robot begins, which it returns.
  Vector2d begin(Start& start, Rng& rng) const;
  // at: where the robot is. Writes the info's "success".
  Outcome step(const Vector2d& at, Row& row, Info& info) const;
  void reset_info(const Sim& s, const Vector2d& at, Info& info) const;
  // The group desired_goal.
  void observe(Robot& r) const;

 private:
  Maze maze_;
  np::Norm norm_;
  bool is_dense_, continues_, moves_goal_;
  double noise_;
  LiveVector goal_cell_, reset_cell_;
  Own site_pos_;
  Eigen::Index target_;  // where site_pos has the site "target", which shows the goal
  Carry goal_, shown_;   // the observation shows the goal that the step's reward was for

  Vector2d draw(const std::vector<Vector2d>& cells, Rng& rng) const;
  Vector2d noisy(Vector2d at, Rng& rng) const;
  bool reaches(const Vector2d& at, const Vector2d& goal) const;
  double reward(const Vector2d& at, const Vector2d& goal) const;
};

}  // namespace mazes
