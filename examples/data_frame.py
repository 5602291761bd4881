"""An experiment, its trials as a data frame of pandas, and the time series of one trial."""

import antennate

if __name__ == "__main__":
    result = antennate.run("tunnel", trials=2, controllers=("open", "closed"), time_limit=5.0)
    print(result.sentence)

    trials = result.to_dataframe()
    print(trials.groupby("controller")[["time_s", "progress_m", "force_mean_n"]].mean())

    series = antennate.simulate("closed", trial=0, time_limit=5.0)
    ticks = series.to_dataframe()
    print(ticks.groupby("maneuver")[["level_left", "level_right"]].mean())
