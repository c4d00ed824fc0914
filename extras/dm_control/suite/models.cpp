#include "models.hpp"

#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace suite {
namespace {

// Replaces each {place} of a text.
std::string filled(std::string text, std::initializer_list<std::pair<std::string, std::string>> places) {
  for (const auto& [place, content] : places) text.replace(text.find('{' + place + '}'), place.size() + 2, content);
  return text;
}

// The shortest decimal that is read back as the same number.
std::string decimal(double number) {
  for (int digits = 1;; ++digits) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(digits);
    text << number;
    if (digits == 17 || std::stod(text.str()) == number) return text.str();
  }
}

}  // namespace

std::string model(const std::string& name) {
  for (std::size_t i = 0; i < model_count; ++i)
    if (models[i].name == name) return models[i].text;
  throw std::logic_error("the suite has no model " + name);
}

// Each pole stands on the end of the one before, 1 m higher.
std::string cartpole_model(int poles) {
  std::string chain, ends;
  for (int i = 1; i <= poles; ++i) {
    const std::string number = std::to_string(i);
    chain += "<body name=\"pole_" + number + (i == 1 ? "\"" : "\" pos=\"0 0 1\"") + " childclass=\"pole\">" +
             "<joint name=\"hinge_" + number + "\"/><geom name=\"pole_" + number + "\"/>";
    ends += "</body>";
  }
  // The longer the chain, the lower it hangs and the more there is to see.
  const std::string z = poles == 1 ? "-0.05" : decimal(1 - poles - .05);
  const int away = poles == 1 ? 2 : 2 * poles;
  return filled(model("cartpole"), {{"poles", chain + ends},
                                    {"floor_z", z},
                                    {"fixed_y", std::to_string(poles == 1 ? -4 : -1 - away)},
                                    {"lookatcart_y", std::to_string(-away)}});
}

// The first link is the head.
std::string swimmer_model(int links) {
  std::string chain, ends, motors, sensors;
  const std::string limit = decimal(360.0 / links);
  for (int i = 0; i < links - 1; ++i) {
    const std::string number = std::to_string(i) + "\"";
    chain += "<body name=\"segment_" + number + " pos=\"0 0.1 0\">" + "<joint name=\"joint_" + number + " range=\"-" +
             limit + " " + limit + "\"/>" + "<geom class=\"visual\" name=\"visual_" + number + "/>" +
             "<geom class=\"inertial\" name=\"inertial_" + number + "/>" + "<site name=\"site_" + number + "/>";
    ends += "</body>";
    motors += "<motor name=\"motor_" + number + " joint=\"joint_" + number + "/>";
    sensors += "<velocimeter name=\"velocimeter_" + number + " site=\"site_" + number + "/>" + "<gyro name=\"gyro_" +
               number + " site=\"site_" + number + "/>";
  }
  // The cameras that follow a swimmer of six links are this far away.
  const double scale = links / 6.0;
  const auto away = [=](double x, double y, double z) {
    return decimal(x * scale) + " " + decimal(y * scale) + " " + decimal(z * scale);
  };
  return filled(model("swimmer"), {{"tracking1", away(0, -.2, .5)},
                                   {"tracking2", away(-.9, .5, .15)},
                                   {"links", chain + ends},
                                   {"motors", motors},
                                   {"sensors", sensors}});
}

// A row of balls, 0.25 m apart, each of which slides on the one before.
std::string lqr_model(int balls, int motors) {
  std::string chain, ends, links, driven;
  for (int i = 0; i < balls; ++i) {
    const std::string number = std::to_string(i) + "\"";
    chain += "<body name=\"body_" + number + " pos=\"0.25 0 " + (i == 0 ? "0.1" : "0") + "\">" +
             "<joint name=\"joint_" + number + "/>" + "<geom name=\"geom_" + number + "/>" + "<site name=\"site_" +
             number + "/>";
    ends += "</body>";
    if (i > 0) {
      const std::string before = std::to_string(i - 1) + "\"";
      links += "<spatial name=\"tendon_" + before + ">" + "<site site=\"site_" + before + "/><site site=\"site_" +
               number + "/></spatial>";
    }
    if (i < motors) driven += "<motor name=\"motor_" + number + " joint=\"joint_" + number + "/>";
  }
  return filled(model("lqr"), {{"balls", chain + ends}, {"links", links}, {"motors", driven}});
}

}  // namespace suite
