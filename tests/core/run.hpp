// What each file tests; 0 if all is well.
#pragma once

int run_cpus();
int run_info();
int run_lanes();
int run_levers();
int run_numpy();
int run_worker();
