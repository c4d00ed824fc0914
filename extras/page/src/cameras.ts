/** Where the camera stands for each robot, in the words of Gymnasium's default_camera_config. */

export interface View {
  /** m, from the point that the camera looks at. */
  distance: number;
  /** Degrees; 90 looks along +y. */
  azimuth: number;
  /** Degrees; negative looks down. */
  elevation: number;
  /** What the camera looks at, m. If it follows, x and y are relative to the robot's centre of mass. */
  lookat: [number, number, number];
  follows: boolean;
}

/** By the name of the robot, without its version. */
export const VIEWS: Record<string, View | undefined> = {
  Ant: { distance: 4, azimuth: 60, elevation: -25, lookat: [0, 0, 0.4], follows: true },
  HalfCheetah: { distance: 3.6, azimuth: 75, elevation: -15, lookat: [0, 0, 0.45], follows: true },
  Hopper: { distance: 3.6, azimuth: 70, elevation: -14, lookat: [0, 0, 0.8], follows: true },
  Humanoid: { distance: 4.2, azimuth: 60, elevation: -15, lookat: [0, 0, 0.95], follows: true },
  HumanoidStandup: { distance: 4.2, azimuth: 60, elevation: -20, lookat: [0, 0, 0.7], follows: true },
  InvertedDoublePendulum: { distance: 3.6, azimuth: 80, elevation: -10, lookat: [0, 0, 0.45], follows: false },
  InvertedPendulum: { distance: 2.6, azimuth: 80, elevation: -12, lookat: [0, 0, 0.2], follows: false },
  Pusher: { distance: 2.4, azimuth: 150, elevation: -35, lookat: [0.2, -0.2, -0.2], follows: false },
  QuadrupedVelocity: { distance: 1.9, azimuth: 60, elevation: -18, lookat: [0, 0, 0.2], follows: true },
  Reacher: { distance: 0.95, azimuth: 90, elevation: -60, lookat: [0, 0, 0], follows: false },
  Swimmer: { distance: 6, azimuth: 75, elevation: -40, lookat: [0, 0, 0], follows: true },
  Walker2d: { distance: 3.8, azimuth: 70, elevation: -14, lookat: [0, 0, 0.8], follows: true },
};
