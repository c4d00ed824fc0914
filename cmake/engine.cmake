# mjenv_engine: MuJoCo 2.2.2, however it is provided.
find_package(Eigen3 3.3 REQUIRED NO_MODULE)
find_package(mujoco 2.2.2 EXACT REQUIRED CONFIG)

add_library(mjenv_engine INTERFACE)
target_link_libraries(mjenv_engine INTERFACE mujoco::mujoco)
